#!/usr/bin/env bash
# Builds all but the benchmarks and runs the test suite, without the tests of the label `long`, which take minutes.
#
#   scripts/test.sh [--all | --werror | --sanitize] [ctest options]
#
# --all also runs the tests of the label `long`.
# --werror also runs them. It builds in build/ci, with warnings as errors and with the benchmarks, and
# installs what the site of the documents needs.
# --sanitize builds and runs the tests of most layers in build/asan, with the sanitizers of addresses and
# undefined behaviour. It builds and runs the tests of threads in build/tsan, with the sanitizer of threads.
# Both need a processor with AVX2.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Open MPI starts nothing as root, as in a container, unless told twice.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

run_tests() {
  local build=$1
  shift
  ctest --test-dir "$build" --output-on-failure --parallel "$(nproc)" "$@"
}

case ${1:-} in
  --werror)
    scripts/setup.sh --tests --docs --build build/ci --targets "all bench/all" -DGAMER_WERROR=ON
    run_tests build/ci "${@:2}"
    ;;
  --sanitize)
    # Leaks are looked for by tracing the process, which some containers forbid.
    export UBSAN_OPTIONS=print_stacktrace=1 TSAN_OPTIONS=halt_on_error=1
    layers="core noise sed image parallel galaxy scene nodes journal threads studio"
    corpora="sed galaxy scene parameters catalogue png_table message request"
    scripts/setup.sh --tests --preset asan --targets "${layers// /_tests }_tests ${corpora// /_corpus }_corpus gamer_python"
    if [[ $(build/asan/tests/sed_tests --gtest_list_tests 2>&1) == *"LeakSanitizer has encountered"* ]]; then
      export ASAN_OPTIONS=detect_leaks=0
    fi
    run_tests build/asan --tests-regex "^(${layers// /|}|python|fuzz\.(${corpora// /|}))$" "${@:2}"
    scripts/setup.sh --tests --preset tsan --targets threads_tests
    run_tests build/tsan --tests-regex '^threads$' "${@:2}"
    ;;
  --all)
    scripts/setup.sh --tests
    run_tests build/release "${@:2}"
    ;;
  *)
    scripts/setup.sh --tests
    run_tests build/release --label-exclude long "$@"
    ;;
esac
