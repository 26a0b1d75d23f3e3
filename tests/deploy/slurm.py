# SPDX-License-Identifier: Apache-2.0
"""A Slurm of two nodes on this machine, in a directory of its own, with ports and keys of its own.

    with Slurm(directory) as slurm:
        slurm.run("sbatch", …)

Runs as root, without systemd and control groups. Partition "low" has both nodes; a job of partition
"urgent" preempts there, after a grace of 30 s.
"""
import os
import pathlib
import secrets
import signal
import socket
import subprocess
import time

CONF = """
ClusterName=penumbra
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={directory}/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2
SlurmctldParameters=preempt_send_user_signal
PreemptType=preempt/partition_prio
PreemptMode=CANCEL
MpiDefault=none
ReturnToService=2
KillWait=5
SlurmdTimeout=10
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
StateSaveLocation={directory}/state
SlurmdSpoolDir={directory}/spool.%n
SlurmctldPidFile={directory}/slurmctld.pid
SlurmdPidFile={directory}/slurmd.%n.pid
SlurmctldLogFile={directory}/slurmctld.log
SlurmdLogFile={directory}/slurmd.%n.log
NodeName=first NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]} CPUs=1 State=UNKNOWN
NodeName=second NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]} CPUs=1 State=UNKNOWN
PartitionName=low Nodes=first,second Default=YES MaxTime=INFINITE State=UP PriorityTier=1 GraceTime=30
PartitionName=urgent Nodes=first,second MaxTime=INFINITE State=UP PriorityTier=10
"""
NODES = ("first", "second")


def free_ports(count):
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in held]
    for one in held:
        one.close()
    return ports


def wait_for(condition, seconds, what):
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < deadline, f"{what}: not within {seconds} s"
        time.sleep(0.1)
    return value


class Slurm:
    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        self.environment = {**os.environ, "SLURM_CONF": str(self.directory / "slurm.conf")}
        self.daemons = {}

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.stop()

    def start(self):
        place = self.directory
        place.chmod(0o755)  # munged looks at all that its socket lies in
        for name in ("state", *(f"spool.{node}" for node in NODES)):
            (place / name).mkdir()
        host = socket.gethostname().split(".")[0]
        text = CONF.format(host=host, directory=place, ports=free_ports(3))
        (place / "slurm.conf").write_text(text)
        key = place / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o600)
        self.spawn("munged", "munged", "--foreground", "--force", f"--socket={place}/munge.socket",
                   f"--key-file={key}", f"--pid-file={place}/munged.pid", f"--log-file={place}/munged.log",
                   f"--seed-file={place}/munged.seed", "--num-threads=2")
        wait_for((place / "munge.socket").exists, 20, "munged")
        self.spawn("slurmctld", "slurmctld", "-D")
        for node in NODES:
            self.spawn(node, "slurmd", "-D", "-N", node)
        wait_for(lambda: self.states() == {node: "idle" for node in NODES}, 40, "both nodes idle")

    def spawn(self, name, *command):
        with open(self.directory / f"{name}.out", "wb") as log:
            self.daemons[name] = subprocess.Popen(["/usr/sbin/" + command[0], *command[1:]],
                                                  env=self.environment, stdin=subprocess.DEVNULL,
                                                  stdout=log, stderr=log)

    def run(self, *command, check=True, **variables):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=60,
                              env={**self.environment, **variables}, check=False)
        assert done.returncode == 0 or not check, f"{command}: {done.stdout} {done.stderr}"
        return done.stdout

    def states(self):
        lines = self.run("sinfo", "--noheader", "--Node", "--partition=low", "--format=%N %T", check=False)
        return dict(line.split() for line in lines.splitlines())

    def job(self, number, what="%T"):
        """A column of squeue about a job; "" when it is gone."""
        return self.run("squeue", "--noheader", f"--jobs={number}", f"--format={what}", check=False).strip()

    def processes(self, node):
        """The node's daemon, its steps and all that runs in its jobs."""
        found = []
        for entry in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                variables = (entry / "environ").read_bytes().split(b"\0")
            except OSError:
                continue
            if f"SLURM_CONF={self.directory}/slurm.conf".encode() in variables and (
                    f"SLURMD_NODENAME={node}".encode() in variables):
                found += [int(entry.name), *step_of(int(entry.name))]
        daemon = self.daemons.get(node)
        return found + ([daemon.pid, *children_of(daemon.pid)] if daemon else [])

    def kill_node(self, node):
        """As if its power had failed: everything of it is killed at once, the daemon first."""
        daemon = self.daemons[node]
        family = self.processes(node)
        kill(daemon.pid, *family)
        daemon.wait(timeout=10)
        del self.daemons[node]
        kill(*self.processes(node))

    def stop(self):
        if "slurmctld" in self.daemons:
            self.run("scancel", "--me", "--full", check=False)
        for node in NODES:
            kill(*self.processes(node))
        for daemon in self.daemons.values():
            daemon.kill()
            daemon.wait(timeout=10)
        self.daemons = {}

    def logs(self):
        return "\n".join(f"--- {path.name}\n{path.read_text(errors='replace')[-3000:]}"
                         for path in sorted(self.directory.glob("*.log")))


def stat_of(pid):
    """(name, parent) of a process, or None."""
    try:
        text = pathlib.Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return None
    return text[text.index("(") + 1:text.rindex(")")], int(text.rsplit(")", 1)[1].split()[1])


def step_of(pid):
    """The slurmstepd that a job's process was started by, which has left its daemon's family."""
    found = stat_of(pid)
    while found and found[1] > 1:
        parent, found = found[1], stat_of(found[1])
        if found and found[0].startswith("slurmstepd"):
            return [parent]
    return []


def children_of(pid):
    found = []
    for entry in pathlib.Path("/proc").glob("[0-9]*"):
        if (stat_of(entry.name) or ("", 0))[1] == pid:
            found += [int(entry.name), *children_of(int(entry.name))]
    return found


def kill(*pids):
    for pid in pids:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
