# Compiler options shared by all of the project's own targets.
add_library(gamer_options INTERFACE)
target_compile_features(gamer_options INTERFACE cxx_std_20)
target_compile_options(gamer_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wextra-semi
  # Contraction would make the scalar target differ from compiler to compiler.
  -ffp-contract=off
  # GCC 12 sees overlaps in std::string's operator+ that are not there (GCC bug 105651).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  $<$<BOOL:${GAMER_WERROR}>:-Werror>)

# Compiles the sources of a library in groups, all but those that Highway compiles once for each target.
function(gamer_compile_in_groups name)
  foreach(source IN LISTS ARGN)
    file(STRINGS ${source} simd REGEX "hwy/foreach_target.h" LIMIT_COUNT 1)
    if(simd)
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON
                                  COMPILE_OPTIONS "${GAMER_SIMD_OPTIONS}")
    endif()
  endforeach()
  set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${GAMER_UNITY_FILES})
  # GCC takes a file of a group for a header, whose classes should not have members of unnamed namespaces.
  target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()

# gamer_add_layer(name LINK ...): the static library gamer_<name> from all sources under src/<name>.
function(gamer_add_layer name)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/${name}/*.cc)
  add_library(gamer_${name} STATIC ${sources})
  add_library(gamer::${name} ALIAS gamer_${name})
  set_target_properties(gamer_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(gamer_${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_compile_features(gamer_${name} PUBLIC cxx_std_20)
  target_link_libraries(gamer_${name} ${ARG_LINK} PRIVATE $<BUILD_INTERFACE:gamer_options>)
  if(GAMER_UNITY)
    gamer_compile_in_groups(gamer_${name} ${sources})
  endif()
endfunction()
