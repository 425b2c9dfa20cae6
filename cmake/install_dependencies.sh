#!/usr/bin/env bash
# Installs the Debian packages that are missing; does nothing when all are there.
# Arguments: further packages.
set -euo pipefail

packages=(build-essential cmake pkg-config coinor-libipopt-dev libmumps-seq-dev libmetis-dev
          libeigen3-dev libamplsolver-dev liblapack-dev libopenblas0-pthread libgtest-dev "$@")
if ! command -v dpkg-query >/dev/null; then
  echo "No Debian system. Needed under their local names: ${packages[*]}" >&2
  exit 0
fi

missing=()
for package in "${packages[@]}"; do
  if ! dpkg-query -W -f='${Status}\n' "$package" 2>/dev/null | grep -q ' installed$'; then
    missing+=("$package")
  fi
done
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi

sudo=()
if [ "$(id -u)" -ne 0 ]; then
  sudo=(sudo)
fi
echo "Installing ${missing[*]}"
"${sudo[@]}" apt-get update -qq </dev/null
"${sudo[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -qq --no-install-recommends "${missing[@]}" </dev/null
