#!/usr/bin/env bash
# Debian packages of the last commit on a machine that has nothing: builds them, looks at them by lintian, installs them
# into a Debian 12 of minimal size by apt, runs the programs of the README, uninstalls, and looks for what is left.
#
#   tests/systems/debian.sh [FOLDER]
#
# As root. Debian: the build dependencies in debian/control, debhelper, lintian, mmdebstrap. FOLDER (build/deb) keeps packages and the root.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=${1:-build/deb}
mkdir -p "$work"
work=$(cd "$work" && pwd)
root=$work/root
TIMEFORMAT="%R s, %U s of the processor"
step() {
  echo "== $1"
  shift
  time "$@"
}

rm -rf "$work/source" "$work"/*.deb "$work"/*.changes
mkdir "$work/source"
git archive HEAD | tar x -C "$work/source"
build() { (cd "$work/source" && dpkg-buildpackage -us -uc -b) >"$work/build.log" 2>&1 || { tail -30 "$work/build.log"; exit 1; }; }
step "dpkg-buildpackage" build
step "lintian" lintian --fail-on error --allow-root "$work"/*.changes
rm -f "$work"/*-dbgsym_*.deb
du -k "$work"/*.deb | sed "s#$work/##"

if [ ! -e "$work/clean/usr" ]; then
  step "mmdebstrap" mmdebstrap --quiet --variant=minbase bookworm "$work/clean"
fi
rm -rf "$root"
cp -a "$work/clean" "$root"
mkdir -p "$root/srv/t/debian"
cp "$work"/*.deb "$root/srv"
cp README.md "$root/srv/t"
cp -r debian/tests "$root/srv/t/debian"
cp /etc/resolv.conf "$root/etc"
mount --bind /dev "$root/dev"
mount -t proc proc "$root/proc"
trap 'umount "$root/dev" "$root/proc"' EXIT

# Files and packages of the root, without what apt and dpkg write for themselves.
state() {
  (cd "$root" && find . -xdev \( -path ./var/lib/apt -o -path ./var/lib/dpkg -o -path ./var/cache -o -path ./var/log -o -path ./tmp \
    -o -path ./proc -o -path ./dev -o -path ./srv -o -path ./run \) -prune -o -print | LC_ALL=C sort) >"$work/$1.files"
  chroot "$root" dpkg-query -W -f '${Package}\n' | LC_ALL=C sort >"$work/$1.packages"
}
inside() { DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 chroot "$root" bash -euc "$1"; }
state before
step "apt-get update" inside "apt-get update -qq"
step "apt install g++ make cmake: compilers for the programs" \
  inside "apt-get install -y -qq --no-install-recommends g++ make cmake pkg-config >/srv/log 2>&1"
step "apt install ./*.deb" inside "cd /srv; apt-get install -y -qq --no-install-recommends ./*.deb >/srv/log 2>&1"
step "programs of the README" inside "bash /srv/t/debian/tests/readme"
inside "zcat -f /usr/share/man/man1/ipminmax.1* | grep -c . | sed 's/$/ lines of the man page/'" || true
names="ipminmax libipminmax0.3 libipminmax-dev libipminmax-mpi python3-ipminmax"
step "uninstall" inside "apt-get purge -y -qq $names >/srv/log 2>&1"
left=$(find "$root" -xdev -iname '*ipminmax*' -not -path "$root/srv/*")
if [ -n "$left" ]; then echo "left: $left"; exit 1; fi
step "uninstall what came with it" inside "apt-get purge -y -qq --autoremove g++ make cmake pkg-config >/srv/log 2>&1"
state after
diff "$work/before.packages" "$work/after.packages"
# Caches that other packages' scripts write (linker, certificates, byte code) are theirs.
diff "$work/before.files" "$work/after.files" | grep '^[<>]' | grep -vE '/(ld\.so\.cache|alternatives/|etc/ssl|ca-certificates)' || true
echo "nothing is left"
