# completion.zsh BIN COMPLETIONS TYPED WANTED: types TYPED and Tab into a zsh, and waits until WANTED stands there.
zmodload zsh/zpty
zpty shell zsh -f -i
said=
# Until the shell has said $1; a minute at most.
await() {
  local chunk
  for ((i = 0; i < 600; ++i)); do
    while zpty -r -t shell chunk; do said+=$chunk; done
    [[ $said == *$1* ]] && return
    sleep 0.1
  done
  print -ru2 -- "zsh did not say $1: ${(V)said}"
  exit 1
}
# The quotes keep the echo of the line from being taken for what it prints.
zpty -w shell "fpath=($2 \$fpath) path=($1 \$path); autoload -Uz compinit; compinit -u -D; print re''ady"
await ready
said=
zpty -w -n shell "$3"$'\t'
await "$4"
