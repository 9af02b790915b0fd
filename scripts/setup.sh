#!/usr/bin/env bash
# Installs what is missing, configures and builds. Quick when there is nothing to do.
#
#   scripts/setup.sh [--tests] [--docs] [--build DIR] [--preset NAME] [--targets "NAME..."]
#                    [CMake options of the first configuration]
#
# --tests also installs what the tests need and builds them; otherwise only the programs and
# the Python package are built.
# --docs also installs what scripts/docs.sh needs.
# DIR is build/NAME where it is not given, NAME is release.
# Exit codes: 2 when packages are missing and cannot be installed from here.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

lists=(scripts/packages.txt)
targets=(gamer gutil python_package)
preset=release
build=
options=()
while (($#)); do
  case $1 in
    --tests) lists+=(scripts/packages-tests.txt) targets=(all) ;;
    --docs) lists+=(scripts/packages-docs.txt) ;;
    --build) build=$2 && shift ;;
    --preset) preset=$2 && shift ;;
    --targets) read -ra targets <<<"$2" && shift ;;
    *) options+=("$1") ;;
  esac
  shift
done

missing_packages() {
  local installed
  installed=$(dpkg-query --show --showformat='${db:Status-Status} ${Package}\n' |
    sed -n 's/^installed //p')
  sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' "${lists[@]}" |
    grep -vxF -f <(echo "$installed") || true
}

install_packages() {
  local as_root=()
  if [[ $(id -u) -ne 0 ]]; then
    if ! sudo -n true 2>/dev/null; then
      echo "setup: packages are missing; install them and start again:" >&2
      echo "  sudo apt-get install --no-install-recommends $*" >&2
      exit 2
    fi
    as_root=(sudo -n)
  fi
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q)
  local install=("${apt[@]}" install --yes --no-install-recommends "$@")
  echo "setup: installing $*"
  # Without package lists, or with lists that have aged, the installation fails at first.
  if ! compgen -G '/var/lib/apt/lists/*_Packages*' >/dev/null || ! "${install[@]}"; then
    "${apt[@]}" update
    "${install[@]}"
  fi
}

build=${build:-build/$preset}

if command -v dpkg-query >/dev/null; then
  mapfile -t missing < <(missing_packages)
  if ((${#missing[@]})); then install_packages "${missing[@]}"; fi
else
  echo "setup: not a Debian system; taking the packages of ${lists[*]} as installed"
fi

if [[ ! -f $build/build.ninja ]]; then cmake --preset "$preset" -B "$build" "${options[@]}"; fi
cmake --build "$build" --parallel "$(nproc)" --target "${targets[@]}"
