#!/bin/sh
# Runs an image for `cargo run`. The arguments are a program, its own arguments, and the image. If
# the program is not installed, prints the command that installs it; cargo would only report that a
# file does not exist.
case $1 in
    probe-rs)
        install='cargo install probe-rs-tools --version 0.32.0 --locked'
        guide=docs/bring-up.md
        ;;
    bbz)
        install='cargo install --locked --path bbz'
        guide=docs/start.md
        ;;
esac
if ! command -v "$1" >/dev/null; then
    echo "error: \`cargo run\` needs \`$1\`, which is not installed" >&2
    echo "help: run \`$install\` in the folder of the repository; $guide has more" >&2
    exit 127
fi
exec "$@"
