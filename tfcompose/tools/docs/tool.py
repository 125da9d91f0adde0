"""The tool for documentation: it writes a site of static pages."""

from tfcompose.foundation.tool import Option, Tool

TOOL = Tool(
    name="docs",
    package=__package__,
    options=(Option(("help",), ("--html",), "tfcompose.tools.docs.option"),),
    extra="docs",
)
