"""A picture of each robot as the browser shows it, for people to look at."""

import io
import os
from pathlib import Path

import pytest
import viser
from PIL import Image

from tests.support.browser import address_of, page_of
from tfcompose.cli.compiling import disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.tools.view.panel import Panel
from tfcompose.tools.view.session import Session

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("browser")]

ROBOTS = sorted((Path(__file__).parents[3] / "robots").glob("*.yaml"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder for pictures, which the environment may name: TFCOMPOSE_TEST_PICTURES."""
    path = Path(os.environ.get("TFCOMPOSE_TEST_PICTURES") or tmp_path)
    path.mkdir(parents=True, exist_ok=True)
    return path


@pytest.mark.parametrize("file", ROBOTS, ids=[file.stem for file in ROBOTS])
def test_each_robot_fills_its_picture(file: Path, server: viser.ViserServer, folder: Path) -> None:
    def compiled(_: object) -> Compiled:
        return compile_robot(
            file.read_text("utf-8"), str(file), library(), read=read_text, disk=disk()
        )

    session = Session({str(file): file.read_text("utf-8")}, compiled, lambda *_: None)
    Panel(server, session, edit=False)
    with page_of(address_of(server), 1400, 900, draws=True) as page:
        page.get_by_text("Frame", exact=True).wait_for()
        page.wait_for_timeout(4000)  # a picture tells nobody that it is drawn
        picture = page.screenshot(path=folder / f"{file.stem}.png")
    with Image.open(io.BytesIO(picture)) as image:
        scene = image.convert("HSV").crop((0, 0, image.width * 6 // 10, image.height))
        coloured = sum(
            count for value, count in enumerate(scene.getchannel("S").histogram()) if value > 40
        )
        assert coloured > 0.002 * scene.width * scene.height
