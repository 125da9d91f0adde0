import os
import signal
import threading
import time

import pytest

from tests.support.waiting import none_but
from tfcompose.foundation.signals import Stop


class Waker:
    def __init__(self) -> None:
        self.woken = threading.Event()

    def trigger_guard_condition(self) -> None:
        self.woken.set()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_sets_the_flag_and_ends_the_wait(number: int) -> None:
    with Stop() as stop:
        assert not stop.requested
        timer = threading.Timer(0.05, os.kill, (os.getpid(), number))
        timer.start()
        start = time.monotonic()
        assert stop.wait(60)
        assert time.monotonic() - start < 30
        assert stop.requested
        timer.join()


def test_a_signal_wakes_what_waits_elsewhere() -> None:
    with Stop() as stop:
        waker = Waker()
        assert stop.waker(stop, lambda: waker) is waker
        os.kill(os.getpid(), signal.SIGTERM)
        assert waker.woken.wait(60)


def test_a_waker_that_comes_after_the_signal_is_triggered_at_once() -> None:
    stop = Stop()
    stop.request()
    waker = Waker()
    stop.waker(stop, lambda: waker)
    assert waker.woken.is_set()


def test_the_same_owner_keeps_its_waker() -> None:
    stop = Stop()
    assert stop.waker(stop, Waker) is stop.waker(stop, Waker)


def test_afterwards_signals_do_what_they_did_before() -> None:
    before = [
        signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    ]
    threads = threading.enumerate()
    with Stop():
        pass
    assert [
        signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    ] == before
    assert none_but(threads)


def test_under_nohup_a_hang_up_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with Stop() as stop:
        os.kill(os.getpid(), signal.SIGHUP)
        assert not stop.wait(0.05)


def test_a_blocked_signal_counts_and_is_blocked_again_afterwards() -> None:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        signal.pthread_kill(
            threading.get_ident(), signal.SIGINT
        )  # other tests' threads do not block it
        with Stop() as stop:
            assert stop.wait(60)
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
