"""Table of the tools that ship with tfcompose, such as import, export, view and deploy.

A tool is a folder with a ``tool.py``. Its ``TOOL`` lists the commands, codes, topics and keys of
the tool. A tool may import every other folder of ``tfcompose``, but not another tool. No other
folder imports a tool: ``tfcompose.foundation.tool`` loads this table at run time.
"""

from tfcompose.tools.adjust.tool import TOOL as ADJUST
from tfcompose.tools.deploy.tool import TOOL as DEPLOY
from tfcompose.tools.docs.tool import TOOL as DOCS
from tfcompose.tools.exporters.tool import TOOL as EXPORT
from tfcompose.tools.fleet.tool import TOOL as FLEET
from tfcompose.tools.importers.tool import TOOL as IMPORT
from tfcompose.tools.prove.tool import TOOL as PROVE
from tfcompose.tools.rebag.tool import TOOL as REBAG
from tfcompose.tools.record.tool import TOOL as RECORD
from tfcompose.tools.ros2.tool import TOOL as ROS2
from tfcompose.tools.treetest.tool import TOOL as TEST
from tfcompose.tools.view.tool import TOOL as VIEW

#: The tools, in the order in which ``tfcompose --help`` lists them.
TOOLS = (IMPORT, VIEW, DEPLOY, EXPORT, FLEET, ROS2, RECORD, REBAG, PROVE, ADJUST, TEST, DOCS)
