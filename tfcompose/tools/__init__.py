"""Tools around the product: importers, exporters, the browser view, deployment, fleets and ROS.

A tool is a folder with a ``tool.py``, whose ``TOOL`` says what it brings. It may use every other
wing; no wing imports a tool, and no tool another: ``tfcompose.foundation.tool`` loads the table.
"""

from tfcompose.tools.deploy.tool import TOOL as DEPLOY
from tfcompose.tools.docs.tool import TOOL as DOCS
from tfcompose.tools.exporters.tool import TOOL as EXPORT
from tfcompose.tools.fleet.tool import TOOL as FLEET
from tfcompose.tools.importers.tool import TOOL as IMPORT
from tfcompose.tools.prove.tool import TOOL as PROVE
from tfcompose.tools.rebag.tool import TOOL as REBAG
from tfcompose.tools.ros2.tool import TOOL as ROS2
from tfcompose.tools.view.tool import TOOL as VIEW

#: The tools that ship, in the order of the help.
TOOLS = (IMPORT, VIEW, DEPLOY, EXPORT, FLEET, ROS2, REBAG, PROVE, DOCS)
