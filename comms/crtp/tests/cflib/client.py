"""A ground station that does as it is told, with unmodified cflib.

usage: client.py PORT   connects to a robot at this UDP port
       client.py        has a link that only records packets

Instructions are lines of JSON on standard input: a list of a name and its arguments. Each is answered by a line of JSON.
"""

import json
import sys
import time

import cflib.crtp
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig
from cflib.crazyflie.mem import MemoryElement, Poly4D
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
from cflib.crazyflie.syncLogger import SyncLogger
from cflib.crtp.crtpstack import CRTPPort
from cflib.positioning.motion_commander import MotionCommander
from cflib.utils.reset_estimator import reset_estimator


class Recorder:
    """A link that keeps the packets that are sent."""

    needs_resending = False

    def __init__(self):
        self.packets = []

    def send_packet(self, packet):
        self.packets.append((bytes([packet.header]) + bytes(packet.data)).hex())


def call(cf, path, *arguments):
    target = cf
    for name in path.split("."):
        target = getattr(target, name)
    target(*arguments)


def record(cf, version, path, *arguments):
    """Returns the packets of a call to a robot with this version of the protocol."""
    cf.link = Recorder()
    cf.platform._protocolVersion = version
    call(cf, path, *arguments)
    return cf.link.packets


def tables(cf):
    """Returns the names and types of all log variables and parameters."""
    logs = {f"{group}.{name}": entry.ctype for group, names in cf.log.toc.toc.items() for name, entry in names.items()}
    parameters = {
        f"{group}.{name}": [entry.ctype, entry.get_readable_access()]
        for group, names in cf.param.toc.toc.items()
        for name, entry in names.items()
    }
    return [logs, parameters]


def read(cf, name):
    """Reads a parameter from the robot."""
    values = []
    group, _, short = name.partition(".")
    cf.param.add_update_callback(group, short, lambda _, value: values.append(value))
    cf.param.request_param_update(name)
    return wait(values)


def write(cf, name, value):
    """Writes a parameter, and returns the value in the answer."""
    values = []
    group, _, short = name.partition(".")
    cf.param.add_update_callback(group, short, lambda _, value: values.append(value))
    cf.param.set_value(name, value)
    return wait(values)


def default(cf, name):
    values = []
    cf.param.get_default_value(name, lambda _, value: values.append(value))
    return wait(values)


def log(cf, variables, period_ms, rows):
    """Returns rows of a log block: time in ms and values."""
    block = LogConfig("block", period_ms)
    for name, ctype in variables:
        block.add_variable(name, ctype)
    read_rows = []
    with SyncLogger(cf, block) as logger:
        for time_ms, values, _ in logger:
            read_rows.append([time_ms, [values[name] for name, _ in variables]])
            if len(read_rows) == rows:
                return read_rows


def upload(cf, pieces):
    """Writes a trajectory, each piece a duration and coefficients of x, y, z and yaw."""
    memory = cf.mem.get_mems(MemoryElement.TYPE_TRAJ)[0]
    memory.trajectory = [Poly4D(duration, *(Poly4D.Poly(values) for values in axes)) for duration, *axes in pieces]
    return memory.write_data_sync()


def states(cf):
    # `read_state_list` waits for 0.2 s only, and a busy computer may take longer.
    return cf.supervisor.decode_bitfield(cf.supervisor._fetch_bitfield(timeout=60))


def console(cf):
    """Asks the robot to notify a person, and returns a line of its console."""
    parts = []
    cf.console.receivedChar.add_callback(parts.append)
    cf.platform.send_user_notification(True)
    while not "".join(parts).endswith("\n"):
        time.sleep(0.001)
    return "".join(parts)


def motion(cf):
    """Flies with the unmodified MotionCommander: up, ahead, down."""
    with MotionCommander(cf, default_height=0.3) as commander:
        commander.forward(0.1)


def landing(cf, height, speed):
    """Returns the set-points of a MotionCommander that takes off and lands at this speed, with their times in ms."""
    setpoints, send = [], cf.link.send_packet
    commander = MotionCommander(cf, default_height=height)

    def record_setpoint(packet):
        if packet.port == CRTPPort.COMMANDER_GENERIC:
            setpoints.append([time.monotonic(), (bytes([packet.header]) + bytes(packet.data)).hex()])
        send(packet)

    cf.link.send_packet = record_setpoint
    commander.take_off(velocity=0.4)
    time.sleep(2)
    commander.land(speed)
    cf.link.send_packet = send
    return [[round(1000 * (at - setpoints[0][0])), packet] for at, packet in setpoints]


def wait(values):
    while not values:
        time.sleep(0.001)
    return values[-1]


FUNCTIONS = {
    f.__name__: f
    for f in (call, record, tables, read, write, default, log, upload, states, console, motion, landing, reset_estimator)
}


def answer(cf):
    # Instructions print their own text, too.
    output, sys.stdout = sys.stdout, sys.stderr
    print("connected", file=output, flush=True)
    for line in sys.stdin:
        name, *arguments = json.loads(line)
        print(json.dumps(FUNCTIONS[name](cf, *arguments)), file=output, flush=True)


if len(sys.argv) > 1:
    cflib.crtp.init_drivers()
    with SyncCrazyflie(f"udp://127.0.0.1:{sys.argv[1]}", cf=Crazyflie()) as robot:
        robot.wait_for_params()
        answer(robot.cf)
else:
    answer(Crazyflie())
