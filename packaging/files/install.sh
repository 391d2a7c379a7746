#!/bin/sh
# Installs Catenary from this folder: ./install.sh [PREFIX], by default /usr/local.
set -eu
cd "$(dirname "$0")"
prefix=${1:-/usr/local}
mkdir -p "$prefix"
cp -R bin lib include share "$prefix/"
echo "Catenary is installed in $prefix. Run $prefix/bin/sim-node, and follow $prefix/share/doc/catenary/docs/first-steps.md."
