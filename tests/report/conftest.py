"""What tests of pages need beside a result folder."""

import base64
import hashlib
import html
import json
import re

import pytest


@pytest.fixture(scope="session")
def foreign_scripts():
    """A function that lists the script elements of a page which its own policy would not let run."""

    def find(page):
        policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page).group(1)
        admitted = html.unescape(policy)
        foreign = []
        for attributes, text in re.findall(r"<script([^>]*)>(.*?)</script", page, flags=re.S | re.I):
            digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
            data = re.fullmatch(r' type="application/json" id="[a-z-]+"', attributes) is not None
            if not data and (attributes or f"'sha256-{digest}'" not in admitted):
                foreign.append((attributes, text[:200]))
            if data:
                json.loads(text)
        return foreign

    return find
