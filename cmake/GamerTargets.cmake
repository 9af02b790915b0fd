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
endfunction()
