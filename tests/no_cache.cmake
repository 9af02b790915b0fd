# Read by ctest before the tests: they measure galaxies anew, and leave nothing in the user's cache.
set(ENV{GAMER_CACHE} off)
