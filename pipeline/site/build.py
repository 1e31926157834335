"""Build the site with Sphinx, from the pages of `docs/` and from sources that are written for it."""

import io
from pathlib import Path
from tempfile import TemporaryDirectory

from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util.docutils import docutils_namespace, patch_docutils

from pipeline.site.sources import write_sources
from trackably.errors import InputError

_HERE = Path(__file__).parent
_SETTINGS = {
    "project": "Trackably",
    "extensions": [
        "myst_nb",
        "sphinx.ext.autodoc",
        "sphinx.ext.napoleon",
        "pipeline.site.formulas",
        "pipeline.site.reference",
    ],
    "html_theme": "furo",
    "html_title": "Trackably",
    "html_static_path": [str(_HERE / "static")],
    "html_css_files": ["report.css"],
    "html_js_files": ["filter.js"],
    "html_math_renderer": "drawn",
    "html_show_sphinx": False,
    "html_show_copyright": False,
    "html_copy_source": False,
    "html_show_sourcelink": False,
    "add_module_names": False,
    "autodoc_member_order": "bysource",
    "autodoc_preserve_defaults": True,
    "autodoc_typehints_format": "short",
    "autodoc_type_aliases": {"ArrayLike": "ArrayLike", "Array": "Array"},
    "python_maximum_signature_line_length": 80,
    "nb_execution_mode": "off",
    "nb_render_markdown_format": "myst",
    "myst_enable_extensions": ["dollarmath"],
    "myst_disable_syntax": ["html_block", "html_inline"],  # a page shows what texts say, and runs none of it
    "myst_heading_anchors": 3,
    "myst_links_external_new_tab": False,
    # A notebook names files of the project, which are not pages.
    "suppress_warnings": [
        "myst.xref_missing",
        "misc.highlighting_failure",
        "toc.not_included",
        "myst.header",
        "config.cache",
    ],
}


def build(project: Path, output: Path) -> list[str]:
    """Build the site of a project into a folder, and return the warnings of Sphinx.

    Raises InputError where there are no results, or where a page cannot be built.
    """
    said, warned = io.StringIO(), io.StringIO()
    with TemporaryDirectory() as temporary:
        sources, doctrees = Path(temporary) / "sources", Path(temporary) / "doctrees"
        write_sources(project, sources)
        try:
            with patch_docutils(), docutils_namespace():
                Sphinx(sources, None, output, doctrees, "html", _SETTINGS, said, warned, freshenv=True).build(True)
        except SphinxError as error:
            raise InputError(f"the report cannot be built: {error}") from error
    (output / ".buildinfo").unlink(missing_ok=True)
    return warned.getvalue().splitlines()
