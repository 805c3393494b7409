"""A Slurm cluster of two nodes on this machine, for as long as a command runs on its controller.

    python3 scripts/cluster.py sinfo                  # after tools/setup.sh cluster; needs root
    python3 scripts/cluster.py bash                   # to try things

Controller and nodes are Linux namespaces: processes, network, mounts and host name of their own, joined by a bridge that
only they see. The controller has slurmctld, slurmdbd and MariaDB, a node has slurmd, each has munged. They share the files
of this machine, as a cluster shares a file system. A node dies as by a loss of power: its link goes down, then its first
process is killed, and the kernel ends all others of the node at once. Nothing outside is changed: /etc/slurm, /etc/hosts
and /run are mounted over for these processes alone, state and logs are in target/cluster, and the kernel ends every process
of the cluster when the first one ends.
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
UNSHARE = ["unshare", "--net", "--mount", "--uts", "--pid", "--fork", "--kill-child", "--mount-proc"]

# A node that does not answer for 15 s is lost; its jobs wait 15 s more. Clusters wait for minutes.
SLURM_CONF = f"""\
ClusterName=dovetail
SlurmctldHost=controller({CONTROLLER})
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=cred_expire=15
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
SlurmdTimeout=15
ReturnToService=2
JobRequeue=1
NodeName=node1 NodeAddr={NODES["node1"]} CPUs=2 RealMemory=4000
NodeName=node2 NodeAddr={NODES["node2"]} CPUs=2 RealMemory=4000
PartitionName=work Nodes=ALL Default=YES MaxTime=INFINITE State=UP DefMemPerCPU=500
"""
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
HOSTS = f"127.0.0.1 localhost\n{CONTROLLER} controller\n" + "".join(f"{address} {name}\n" for name, address in NODES.items())

# The first process of a node; it takes in those whose parents have ended.
NODE = """
set -eu
hostname "$NAME"
mount -t tmpfs tmpfs /run
mkdir -p -m 755 /run/munge
until ip link show eth0 >/dev/null 2>&1; do sleep 0.05; done
ip link set lo up
ip address add "$ADDRESS/24" dev eth0
ip link set eth0 up
munged --foreground --key-file="$KEY" --seed-file=/run/munge/seed >"$LOGS/munged.log" 2>&1 &
until [ -S /run/munge/munge.socket.2 ]; do sleep 0.05; done
slurmd -D >"$LOGS/slurmd.out" 2>&1 &
wait
"""
KEY = f"{STATE}/munge.key"
links = {}


def enter():
    """Goes on in namespaces of its own: this program begins again there, as their first process."""
    if os.getpid() != 1:
        os.execvp(UNSHARE[0], [*UNSHARE, "--", sys.executable, *sys.orig_argv[1:]])
    # A first process hears only what it listens to.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))


def run(*command):
    """What a command says, which must succeed."""
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode != 0:
        sys.exit(f"cluster: {' '.join(command)} ended with {ended.returncode}: {ended.stderr.strip()}")
    return ended.stdout


def wait_for(what, condition, seconds=60):
    """Waits until `condition` is true."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"cluster: {what} did not come within {seconds} s; see the logs in {STATE}")
        time.sleep(0.2)


def listens(address, port):
    try:
        socket.create_connection((address, port), 1).close()
    except OSError:
        return False
    return True


def daemon(*command):
    """Starts a daemon of the controller in the foreground."""
    with open(f"{STATE}/controller/{command[0]}.out", "w") as log:
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)


def write(name, text, mode):
    with open(f"{STATE}/{name}", "w", opener=lambda path, flags: os.open(path, flags, mode)) as file:
        file.write(text)


def up():
    """Everything, until both nodes are idle; `enter` comes before it."""
    shutil.rmtree(STATE, ignore_errors=True)
    for folder in ("etc", "controller/state", "controller/mariadb"):
        os.makedirs(f"{STATE}/{folder}")
    write("etc/slurm.conf", SLURM_CONF, 0o644)
    write("etc/slurmdbd.conf", SLURMDBD_CONF, 0o600)
    write("hosts", HOSTS, 0o644)
    write("munge.key", os.urandom(64).hex(), 0o400)
    socket.sethostname("controller")
    os.makedirs("/etc/slurm", exist_ok=True)
    run("mount", "--bind", f"{STATE}/etc", "/etc/slurm")
    run("mount", "--bind", f"{STATE}/hosts", "/etc/hosts")
    run("mount", "-t", "tmpfs", "tmpfs", "/run")
    run("mkdir", "-m", "755", "/run/munge")
    run("ip", "link", "set", "lo", "up")
    run("ip", "link", "add", "cluster", "type", "bridge")
    run("ip", "address", "add", f"{CONTROLLER}/24", "dev", "cluster")
    run("ip", "link", "set", "cluster", "up")
    daemon("munged", "--foreground", f"--key-file={KEY}", "--seed-file=/run/munge/seed")
    # Without tables of its own, which hold users and plugins.
    daemon("mariadbd", "--no-defaults", f"--datadir={STATE}/controller/mariadb", "--user=root", "--bind-address=127.0.0.1",
           "--socket=/run/mariadb.sock", "--pid-file=/run/mariadb.pid", "--skip-grant-tables", "--innodb-buffer-pool-size=64M")
    wait_for("MariaDB", lambda: listens("127.0.0.1", 3306))
    wait_for("munged", lambda: os.path.exists("/run/munge/munge.socket.2"))
    daemon("slurmdbd", "-D")
    wait_for("slurmdbd", lambda: listens("127.0.0.1", 6819))
    run("sacctmgr", "--immediate", "add", "cluster", "dovetail")
    run("sacctmgr", "--immediate", "add", "account", "studies", "Cluster=dovetail")
    run("sacctmgr", "--immediate", "add", "user", "root", "Account=studies")
    daemon("slurmctld", "-D")
    wait_for("slurmctld", lambda: listens(CONTROLLER, 6817))
    for name in NODES:
        start(name)
    for name in NODES:
        wait_for(f"{name} idle", lambda: state(name).startswith("IDLE"))


def start(name):
    """Switches a node on."""
    logs = f"{STATE}/{name}"
    os.makedirs(f"{logs}/spool", exist_ok=True)
    environment = {**os.environ, "NAME": name, "ADDRESS": NODES[name], "KEY": KEY, "LOGS": logs}
    node = subprocess.Popen(
        [*UNSHARE, "bash", "-c", NODE], env=environment, stdin=subprocess.DEVNULL, start_new_session=True
    )
    # The link goes to the network of this process, once it has its own.
    own = os.readlink("/proc/self/ns/net")
    wait_for(f"the network of {name}", lambda: os.readlink(f"/proc/{node.pid}/ns/net") != own)
    link = f"{name}-{node.pid}"
    run("ip", "link", "add", link, "type", "veth", "peer", "name", "eth0", "netns", str(node.pid))
    run("ip", "link", "set", link, "master", "cluster", "up")
    links[name] = node, link


def kill(name):
    """Takes a node's power away."""
    node, link = links.pop(name)
    # Nobody hears of the processes that end.
    run("ip", "link", "set", link, "down")
    # The kernel kills the first process of the node with its parent, and all others with it.
    node.kill()
    node.wait()


def state(name):
    """As Slurm has it: IDLE, MIXED; with a star where it does not hear of the node."""
    return run("sinfo", "--noheader", "--Node", "--nodes", name, "--format", "%T").strip().upper()


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    enter()
    up()
    sys.exit(subprocess.run(sys.argv[1:]).returncode)
