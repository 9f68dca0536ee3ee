# Completion of bash for the programs of Lumigraph: each says itself what may stand next.
_lumigraph() {
  local IFS=$'\n'
  mapfile -t COMPREPLY < <("$1" --complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -o bashdefault -o default -F _lumigraph \
  lumi-calibrate lumi-export lumi-pipeline lumi-proxy lumi-reconstruct lumi-render lumi-simulate lumi-stabilize lumi-timeperiodic lumi-view
