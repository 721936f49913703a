"""Flashes a raw binary or a release with the unmodified bootloader classes of cflib, as cfloader does after a warm boot.

usage: flash.py FILE PORT [PAGES]

The robot is a model that listens at a TCP port of this computer: each CRTP packet is a byte with its length, then header and
data. The link driver for it is registered in cflib's own list of drivers. With PAGES, flashing is stopped by the user before
that page is loaded, and the robot stays in its loader.
"""

import select
import socket
import sys

import cflib.crtp
from cflib.bootloader import Bootloader, Target
from cflib.crtp.crtpdriver import CRTPDriver
from cflib.crtp.crtpstack import CRTPPacket
from cflib.crtp.exceptions import WrongUriType

FILE, PORT = sys.argv[1], int(sys.argv[2])
PAGES = int(sys.argv[3]) if len(sys.argv) > 3 else None
ROBOT = "radio://0/80/2M/E7E7E7E7E7"


class TcpRadio(CRTPDriver):
    """A driver for `radio://` that reaches the model."""

    def connect(self, uri, radio_link_statistics_callback, link_error_callback):
        if not uri.startswith("radio://"):
            raise WrongUriType("not a radio")
        self.uri = uri
        self.socket = socket.create_connection(("127.0.0.1", PORT))

    def send_packet(self, pk):
        self.socket.sendall(bytes([1 + len(pk.data), pk.header]) + bytes(pk.data))

    def receive_packet(self, wait=0):
        readable, _, _ = select.select([self.socket], [], [], None if wait < 0 else wait)
        if not readable:
            return None
        packet = self.receive_bytes(self.receive_bytes(1)[0])
        return CRTPPacket(packet[0], list(packet[1:]))

    def receive_bytes(self, count):
        data = b""
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part:
                raise ConnectionError("the model has ended")
            data += part
        return data

    def close(self):
        self.socket.close()


cflib.crtp.CLASSES.append(TcpRadio)
bootloader = Bootloader(ROBOT)
assert bootloader.start_bootloader(warm_boot=True), "the robot does not enter its loader"
loaded = 0


def is_stopped():
    global loaded
    loaded += 1
    return PAGES is not None and loaded > PAGES


bootloader.terminate_flashing_cb = is_stopped
try:
    bootloader.flash(FILE, [Target("cf2", "stm32", "fw", [], [])])
except Exception as error:
    if str(error) != "Flashing terminated":
        raise
    print("stopped")
else:
    assert bootloader.reset_to_firmware(), "the robot does not restart"
    print("flashed")
bootloader.close()
