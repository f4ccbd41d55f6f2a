"""Templates of the package, wherever it is installed; what is put into them is escaped."""

from importlib import resources
from typing import Any

from jinja2 import BaseLoader, Environment, StrictUndefined, TemplateNotFound
from markupsafe import Markup

from ploughval.report.text import slug


def template_text(name: str) -> str:
    """A file of the folder ``templates`` beside this module.

    Raises
    ------
    OSError
        No file of this name.
    """
    file = resources.files("ploughval.report").joinpath("templates", name)
    return file.read_text(encoding="utf-8")


def rendered(template: str, **context: Any) -> Markup:
    """A template with everything escaped that is not markup."""
    environment = Environment(
        loader=_PackageTemplates(),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["slug"] = slug
    return Markup(environment.get_template(template).render(context))


class _PackageTemplates(BaseLoader):
    """Templates of the package (in a zip too)."""

    def get_source(self, environment: Environment, template: str) -> tuple[str, None, None]:
        try:
            return template_text(template), None, None
        except OSError:
            raise TemplateNotFound(template) from None
