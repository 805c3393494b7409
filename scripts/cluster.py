"""A Slurm cluster of two nodes on this machine, for as long as a command runs on its controller.

    python3 scripts/cluster.py sinfo                  # after tools/setup.sh cluster; needs root
    python3 scripts/cluster.py bash                   # to try things

Controller and nodes are sets of Linux namespaces: processes, network, mounts and host name of their own, joined by a
bridge that only they see. The controller has slurmctld, slurmdbd and MariaDB, a node has slurmd, each has munged. They
share the files of this machine, as a cluster shares a file system. A node dies as by a loss of power: its link goes down,
then its first process is killed, and the kernel ends all others of the node at once.

Nothing outside is changed or left: /etc/slurm, /etc/hosts and /run are mounted over for these processes alone, state and
logs are in target/cluster, and the kernel ends every process of the cluster when the first one ends, however it ends.
Standard library only.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
STATE = os.path.join(ROOT, "target/cluster")
NODES = {"node1": "10.200.77.11", "node2": "10.200.77.12"}
CONTROLLER = "10.200.77.1"
CORES = 2
MEMORY_MB = 4000
# After so long without an answer a node is taken for lost. Clusters wait for minutes.
LOST_S = 15
# A job that was taken from a lost node waits for so long before it runs again; 120 where nothing is said.
REQUEUE_WAIT_S = 15
PROGRAMS = ["slurmctld", "slurmd", "slurmdbd", "sbatch", "sacct", "munged", "mariadbd", "ip", "unshare"]
INSIDE = "DOVETAIL_CLUSTER"

SLURM_CONF = f"""\
ClusterName=dovetail
SlurmctldHost=controller({CONTROLLER})
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=cred_expire={REQUEUE_WAIT_S}
StateSaveLocation={STATE}/controller/state
SlurmdSpoolDir={STATE}/%n/spool
SlurmctldPidFile=/run/slurmctld.pid
SlurmdPidFile=/run/slurmd.pid
SlurmctldLogFile={STATE}/controller/slurmctld.log
SlurmdLogFile={STATE}/%n/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=5
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
AccountingStorageType=accounting_storage/slurmdbd
AccountingStorageHost=controller
AccountingStoreFlags=job_comment
MpiDefault=none
SlurmdParameters=config_overrides
SlurmdTimeout={LOST_S}
ReturnToService=2
JobRequeue=1
"""
SLURM_CONF += "".join(
    f"NodeName={name} NodeAddr={address} CPUs={CORES} RealMemory={MEMORY_MB}\n" for name, address in NODES.items()
)
SLURM_CONF += "PartitionName=work Nodes=ALL Default=YES MaxTime=INFINITE State=UP DefMemPerCPU=500\n"

SLURMDBD_CONF = f"""\
DbdHost=controller
AuthType=auth/munge
SlurmUser=root
LogFile={STATE}/controller/slurmdbd.log
PidFile=/run/slurmdbd.pid
StorageType=accounting_storage/mysql
StorageHost=127.0.0.1
StorageUser=root
StorageLoc=slurm
"""

# The first process of a node; it takes in those whose parents have ended.
NODE = """
set -eu
hostname "$NAME"
mount -t tmpfs tmpfs /run
mkdir -p -m 755 /run/munge
[ -z "$PROCESSOR" ] || mount --bind "$PROCESSOR" /proc/cpuinfo
until ip link show eth0 >/dev/null 2>&1; do sleep 0.05; done
ip link set lo up
ip address add "$ADDRESS/24" dev eth0
ip link set eth0 up
munged --foreground --key-file="$KEY" --seed-file=/run/munge/seed >"$LOGS/munged.log" 2>&1 &
until [ -S /run/munge/munge.socket.2 ]; do sleep 0.05; done
slurmd -D >"$LOGS/slurmd.out" 2>&1 &
wait
"""


class ClusterError(Exception):
    """What is missing or went wrong, with what to do."""


def enter():
    """Goes on in namespaces of its own: this program begins again there, as their first process."""
    if os.environ.get(INSIDE) == "1":
        # Not the command's business.
        del os.environ[INSIDE]
        # A first process hears only what it listens to.
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
        return
    if os.geteuid() != 0:
        raise ClusterError("a cluster on this machine needs root, for its namespaces: run the command with sudo")
    missing = [program for program in PROGRAMS if not shutil.which(program)]
    if missing:
        raise ClusterError(f"not installed: {', '.join(missing)}; run tools/setup.sh cluster")
    namespaces = ["unshare", "--net", "--mount", "--uts", "--pid", "--fork", "--kill-child", "--mount-proc", "--"]
    tried = subprocess.run([*namespaces, "true"], capture_output=True, text=True)
    if tried.returncode != 0:
        raise ClusterError(
            f"this machine gives root no namespaces ({tried.stderr.strip()}): in a container they need CAP_SYS_ADMIN and "
            "CAP_NET_ADMIN; run this on a machine of your own"
        )
    os.environ[INSIDE] = "1"
    sys.stdout.flush()
    os.execvp(namespaces[0], [*namespaces, sys.executable, *sys.orig_argv[1:]])


def run(*command):
    """What a command says, which must succeed."""
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode != 0:
        raise ClusterError(f"{' '.join(command)} ended with {ended.returncode}: {ended.stderr.strip()}")
    return ended.stdout


def wait_for(what, condition, seconds):
    """Waits until `condition` is true."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise ClusterError(f"{what} did not come within {seconds} s; see the logs in {STATE}")
        time.sleep(0.2)


class Cluster:
    """The daemons; `enter` comes before it."""

    def __init__(self):
        shutil.rmtree(STATE, ignore_errors=True)
        os.makedirs(f"{STATE}/controller/state")
        os.makedirs(f"{STATE}/etc")
        self.key = f"{STATE}/munge.key"
        self.nodes = {}
        self.daemons = []
        self.serial = 0
        for name, text in [
            ("etc/slurm.conf", SLURM_CONF),
            ("etc/slurmdbd.conf", SLURMDBD_CONF),
            ("hosts", f"127.0.0.1 localhost\n{CONTROLLER} controller\n" + "".join(f"{a} {n}\n" for n, a in NODES.items())),
        ]:
            with open(f"{STATE}/{name}", "w") as file:
                file.write(text)
        os.chmod(f"{STATE}/etc/slurmdbd.conf", 0o600)
        with open(self.key, "wb", opener=lambda path, flags: os.open(path, flags, 0o400)) as file:
            file.write(os.urandom(128))
        socket.sethostname("controller")
        os.makedirs("/etc/slurm", exist_ok=True)
        run("mount", "--bind", f"{STATE}/etc", "/etc/slurm")
        run("mount", "--bind", f"{STATE}/hosts", "/etc/hosts")
        run("mount", "-t", "tmpfs", "tmpfs", "/run")
        os.mkdir("/run/munge")
        os.chmod("/run/munge", 0o755)
        run("ip", "link", "set", "lo", "up")
        run("ip", "link", "add", "cluster", "type", "bridge")
        run("ip", "address", "add", f"{CONTROLLER}/24", "dev", "cluster")
        run("ip", "link", "set", "cluster", "up")

    def daemon(self, *command):
        """Starts a daemon of the controller in the foreground."""
        name = os.path.basename(command[0])
        with open(f"{STATE}/controller/{name}.out", "w") as log:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
        self.daemons.append(process)

    def up(self, processors=None):
        """Everything, until both nodes are idle; `processors` as for `start`, by node."""
        self.daemon("munged", "--foreground", f"--key-file={self.key}", "--seed-file=/run/munge/seed")
        data = f"{STATE}/controller/mariadb"
        os.mkdir(data)
        self.daemon(
            "mariadbd", "--no-defaults", f"--datadir={data}", "--user=root", "--bind-address=127.0.0.1",
            # Without tables of its own, which hold users and plugins.
            "--socket=/run/mariadb.sock", "--pid-file=/run/mariadb.pid", "--skip-grant-tables",
            "--innodb-buffer-pool-size=64M",
        )
        wait_for("MariaDB", lambda: listens("127.0.0.1", 3306), 30)
        wait_for("munged", lambda: os.path.exists("/run/munge/munge.socket.2"), 30)
        self.daemon("slurmdbd", "-D")
        wait_for("slurmdbd", lambda: listens("127.0.0.1", 6819), 60)
        run("sacctmgr", "--immediate", "add", "cluster", "dovetail")
        run("sacctmgr", "--immediate", "add", "account", "studies", "Cluster=dovetail")
        run("sacctmgr", "--immediate", "add", "user", "root", "Account=studies")
        self.daemon("slurmctld", "-D")
        wait_for("slurmctld", lambda: listens(CONTROLLER, 6817), 30)
        for name in NODES:
            self.start(name, (processors or {}).get(name, ""))
        for name in NODES:
            self.wait_for_state(name, "IDLE", 60)

    def start(self, name, processor=""):
        """Switches a node on, with another /proc/cpuinfo where one is given."""
        logs = f"{STATE}/{name}"
        os.makedirs(f"{logs}/spool", exist_ok=True)
        environment = {**os.environ, "NAME": name, "ADDRESS": NODES[name], "KEY": self.key, "LOGS": logs, "PROCESSOR": processor}
        command = ["unshare", "--net", "--mount", "--uts", "--pid", "--fork", "--kill-child", "--mount-proc", "bash", "-c", NODE]
        # Begin with the network of the node: the link goes to the namespace of this process.
        node = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, start_new_session=True)
        own = os.readlink("/proc/self/ns/net")
        wait_for(f"the network of {name}", lambda: os.readlink(f"/proc/{node.pid}/ns/net") != own, 10)
        self.serial += 1
        link = f"{name}-{self.serial}"
        run("ip", "link", "add", link, "type", "veth", "peer", "name", "eth0", "netns", str(node.pid))
        run("ip", "link", "set", link, "master", "cluster", "up")
        self.nodes[name] = (node, link)

    def kill(self, name):
        """Takes a node's power away."""
        node, link = self.nodes.pop(name)
        # Nobody hears of the processes that end.
        run("ip", "link", "set", link, "down")
        # The kernel kills the first process of the node with its parent, and all others with it.
        node.kill()
        node.wait()

    def state(self, name):
        """As Slurm has it: IDLE, MIXED, DOWN*, COMPLETING*."""
        return run("sinfo", "--noheader", "--Node", "--nodes", name, "--format", "%T").strip().upper()

    def is_lost(self, name):
        """Whether Slurm does not hear of it."""
        return self.state(name).endswith("*")

    def wait_for_state(self, name, state, seconds):
        wait_for(f"{name} {state.lower()}", lambda: self.state(name).startswith(state), seconds)


def listens(address, port):
    try:
        socket.create_connection((address, port), 1).close()
    except OSError:
        return False
    return True


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        enter()
        Cluster().up()
        code = subprocess.run(sys.argv[1:]).returncode
    except ClusterError as error:
        sys.exit(f"cluster: {error}")
    sys.exit(code)


if __name__ == "__main__":
    main()
