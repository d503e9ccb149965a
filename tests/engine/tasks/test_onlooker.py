import os
import signal
import subprocess
import sys
import time

from tests.support.faulty import ROOT

CALL = """
import os, signal, sys, time
from engine.tasks import watchdog

watchdog.TICK = 0.1
observed = watchdog._get_onlooker(0.5)
print(observed._process.pid, flush=True)
observed.begin("step of task 'stuck' has not returned after 0 s".encode())
if sys.argv[1] == "ends":
    observed.end()
if sys.argv[1] == "is stopped":
    os.kill(os.getpid(), signal.SIGSTOP)
    observed.end()
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGALRM})
time.sleep(2.0 if sys.argv[1] != "hangs" else 60.0)
print("on its way", flush=True)
"""


def start(what):
    return subprocess.Popen(
        [sys.executable, "-c", CALL, what],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def test_a_call_that_nothing_interrupts_is_ended_from_outside_with_its_name():
    process = start("hangs")
    _, said = process.communicate(timeout=30)
    assert process.returncode == -signal.SIGKILL
    assert said == (
        "tensatlas: step of task 'stuck' has not returned after 0 s and cannot be interrupted."
        " What was finished is saved\n"
    )


def test_a_process_whose_call_has_ended_is_left_alone():
    printed, said = start("ends").communicate(timeout=30)
    assert (printed.split("\n")[1], said) == ("on its way", "")


def test_a_stopped_process_has_all_the_time_it_wants():
    process = start("is stopped")
    process.stdout.readline()
    time.sleep(2.0)
    process.send_signal(signal.SIGCONT)
    printed, said = process.communicate(timeout=30)
    assert (printed, said) == ("on its way\n", "")


def test_the_onlooker_ends_with_the_process_that_it_looks_at():
    process = start("ends")
    onlooker = int(process.stdout.readline())
    assert is_there(onlooker)
    process.kill()
    process.wait()
    deadline = time.monotonic() + 10.0
    while is_there(onlooker):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def is_there(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
