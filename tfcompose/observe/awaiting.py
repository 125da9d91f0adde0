"""Waiting for a transform without standing still: tf2_ros's futures and coroutines."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tfcompose.observe.exceptions import InvalidArgumentException, TransformException
from tfcompose.observe.lookups import Lookups

if TYPE_CHECKING:
    from collections.abc import Callable


class Awaits(Lookups):
    """A buffer whose answers may be awaited.

    A program that has loaded rclpy gets its ``Future``, for ``spin_until_future_complete`` and coroutines that an
    executor runs; any other that of ``concurrent.futures``, and coroutines for asyncio.
    """

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Return a future whose result is what ``lookup_transform`` returns, as soon as there is one."""
        return self._future(lambda: self.lookup_transform(target_frame, source_frame, time))

    def wait_for_transform_full_async(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> Any:
        """Return a future whose result is what ``lookup_transform_full`` returns, as soon as there is one."""
        asked = target_frame, target_time, source_frame, source_time, fixed_frame
        return self._future(lambda: self.lookup_transform_full(*asked))

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Wait until there is such a transform, and return it."""
        return await _awaitable(self.wait_for_transform_async(target_frame, source_frame, time))

    async def lookup_transform_full_async(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> Any:
        """Wait until there is such a transform, and return it."""
        asked = target_frame, target_time, source_frame, source_time, fixed_frame
        return await _awaitable(self.wait_for_transform_full_async(*asked))

    def _future(self, attempt: Callable[[], Any]) -> Any:
        """Return a future that is done when the attempt succeeds: now, or after something new was taken.

        A frame's name that can never be one ends it with the exception.
        """
        future = import_module("rclpy.task" if "rclpy.task" in sys.modules else "concurrent.futures").Future()

        def check() -> None:
            with self._lock:
                if check not in self.on_news:
                    return  # another thread was quicker, or it was cancelled
                try:
                    answer, error = attempt(), None
                except InvalidArgumentException as wrong:
                    answer, error = None, wrong
                except TransformException:
                    return
                self.on_news.remove(check)
            if error:
                future.set_exception(error)
            else:
                future.set_result(answer)

        def forget(_: object) -> None:
            with self._lock:
                if check in self.on_news:
                    self.on_news.remove(check)

        with self._lock:
            self.on_news.append(check)
        future.add_done_callback(forget)
        check()
        return future


def _awaitable(future: Any) -> Any:
    return future if hasattr(future, "__await__") else import_module("asyncio").wrap_future(future)
