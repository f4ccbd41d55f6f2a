"""A link to an HTML file of the repository opens it: Sphinx would have the browser save it as a download."""

from pathlib import PurePosixPath
from typing import Any

from docutils import nodes
from sphinx.addnodes import download_reference
from sphinx.application import Sphinx
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util.osutil import relative_uri


class OpenPages(SphinxPostTransform):
    """Makes plain links of downloads that are pages."""

    default_priority = 900
    formats = ("html",)

    def run(self, **_: Any) -> None:
        """Go through the page's downloads; the file itself is still copied as one."""
        here = self.env.app.builder.get_target_uri(self.env.docname)
        for download in list(self.document.findall(download_reference)):
            name = PurePosixPath(download.get("filename", ""))
            if name.suffix == ".html":
                place = relative_uri(here, f"_downloads/{name}")
                download.replace_self(
                    nodes.reference("", "", *download.children, refuri=place, internal=True)
                )


def setup(app: Sphinx) -> dict[str, Any]:
    """Take part in every build."""
    app.add_post_transform(OpenPages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
