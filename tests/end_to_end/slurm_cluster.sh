#!/usr/bin/env bash
# A Slurm cluster of two nodes on this machine, for tests, as root: munged, slurmctld, and two slurmd by name.
#   slurm_cluster.sh start FOLDER          everything in FOLDER; SLURM_CONF=FOLDER/slurm.conf is what clients need
#   slurm_cluster.sh kill-node FOLDER n1   its slurmd and the jobs on it, by SIGKILL
#   slurm_cluster.sh start-node FOLDER n1
#   slurm_cluster.sh restart-controller FOLDER
#   slurm_cluster.sh stop FOLDER
# Ports are 16800 and the next ones. Exit code 77: Slurm or munge is not installed.
set -euo pipefail
command=$1 folder=$2
export PATH=$PATH:/usr/sbin SLURM_CONF=$folder/slurm.conf
for program in munged slurmctld slurmd sbatch; do
  command -v $program >/dev/null || { printf '%s is not installed\n' $program >&2; exit 77; }
done

node() { slurmd -N "$1" -f "$SLURM_CONF"; }
pid_of() { cat "$folder/$1.pid"; }
gone() { # PID: waits until it is
  for _ in $(seq 100); do kill -0 "$1" 2>/dev/null || return 0; sleep 0.1; done
  kill -9 "$1" 2>/dev/null || true
}

case $command in
  start)
    mkdir -p "$folder"/state "$folder"/spool/n1 "$folder"/spool/n2
    chmod 700 "$folder"
    head -c 1024 /dev/urandom >"$folder/munge.key"
    chmod 400 "$folder/munge.key"
    munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
      --log-file="$folder/munged.log" --seed-file="$folder/munged.seed"
    cat >"$SLURM_CONF" <<CONF
ClusterName=lumi
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmctldPort=16800
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool/%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=10
SlurmctldTimeout=30
MinJobAge=600
MailProg=/bin/true
NodeName=n1 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=16801 CPUs=$(nproc)
NodeName=n2 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=16802 CPUs=$(nproc)
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
    printf 'CgroupPlugin=autodetect\nConstrainCores=no\n' >"$folder/cgroup.conf"
    slurmctld -f "$SLURM_CONF"
    node n1
    node n2
    for _ in $(seq 300); do
      [ "$(sinfo -h -t idle -o %D 2>/dev/null | paste -sd+ | sed 's/^$/0/')" = 2 ] && exit 0
      sleep 0.1
    done
    printf 'the cluster does not come up:\n' >&2
    sinfo >&2 || true
    tail -n 5 "$folder"/*.log >&2
    exit 1 ;;
  kill-node)
    # A node that dies takes its jobs with it: slurmd first, so that it reports nothing.
    kill -9 "$(pid_of "$3")"
    for spool in "$folder/spool/$3"/job*; do
      [ -d "$spool" ] || continue
      id=${spool##*/job} id=$((10#$id))
      for step in $(pgrep -f "^slurmstepd: \[$id\."); do
        children=$(pgrep -P "$step" || true)
        kill -9 "$step"
        for child in $children; do kill -9 -- "-$child" 2>/dev/null || kill -9 "$child" 2>/dev/null || true; done
      done
    done ;;
  start-node) node "$3" ;;
  restart-controller)
    pid=$(pid_of slurmctld)
    kill -9 "$pid"
    gone "$pid"
    slurmctld -f "$SLURM_CONF" ;;
  stop)
    scancel -u root 2>/dev/null || true
    for name in n1 n2 slurmctld munged; do
      [ -f "$folder/$name.pid" ] || continue
      pid=$(pid_of $name)
      kill "$pid" 2>/dev/null || true
      gone "$pid"
    done ;;
esac
