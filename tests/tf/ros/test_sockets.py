"""What sockets hold, and what they lost, as the kernel counts it."""

import socket
from collections.abc import Iterator

import pytest

from tfcompose.tf.ros.sockets import LostDatagrams, buffer_limit, widen_buffers


@pytest.fixture
def receiver() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind(("127.0.0.1", 0))
        yield bound


def send(receiver: socket.socket, number: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(number):
            sender.sendto(bytes(1900), receiver.getsockname())


def received(receiver: socket.socket) -> int:
    receiver.settimeout(0)
    count = 0
    while True:
        try:
            receiver.recv(2000)
        except BlockingIOError:
            return count
        count += 1


def test_each_datagram_that_a_full_socket_dropped_is_counted_once(receiver: socket.socket) -> None:
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 20_000)
    lost = LostDatagrams()
    send(receiver, 100)
    assert (lost.take(), lost.take()) == (100 - received(receiver), 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM):
        send(receiver, 1)
        assert lost.take() == 0


def test_a_socket_holds_as_much_as_the_kernel_grants(receiver: socket.socket) -> None:
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 20_000)
    widen_buffers()
    assert receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) >= (buffer_limit() or 20_001)
