# Installs the program, its data and the libraries as the CMake package "gamer".
include(CMakePackageConfigHelpers)

# gamer::gamer brings all layers.
add_library(gamer_library INTERFACE)
add_library(gamer::gamer ALIAS gamer_library)
set_target_properties(gamer_library PROPERTIES EXPORT_NAME gamer)
target_link_libraries(gamer_library INTERFACE gamer_job gamer_processing)

set(gamer_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/gamer)

install(TARGETS ${gamer_programs} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS gamer_core gamer_noise gamer_sed gamer_image gamer_processing gamer_parallel gamer_galaxy
                gamer_scene
                gamer_render gamer_job gamer_library
  EXPORT gamerTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT gamerTargets NAMESPACE gamer:: DESTINATION ${gamer_package_dir})
install(DIRECTORY include/gamer DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN *.h
        PATTERN studio EXCLUDE)
install(DIRECTORY seds bandpasses galaxies instruments scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/gamer)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
# Shells look for completions in these folders of share/.
foreach(program ${gamer_programs})
  set(manual ${gamer_manuals}/${program})
  install(FILES ${manual}.man DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 RENAME ${program}.1)
  install(FILES ${manual}.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
          RENAME ${program})
  install(FILES ${manual}.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions
          RENAME _${program})
endforeach()

# Whether gamer_parallel, a static library, leaves MPI for its users to link.
get_target_property(gamer_parallel_libraries gamer_parallel LINK_LIBRARIES)
if("MPI::MPI_CXX" IN_LIST gamer_parallel_libraries)
  set(gamer_needs_mpi ON)
else()
  set(gamer_needs_mpi OFF)
endif()
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/gamerConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/gamerConfig.cmake INSTALL_DESTINATION ${gamer_package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/gamerConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/gamerConfig.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/gamerConfigVersion.cmake
  DESTINATION ${gamer_package_dir})

# pkg-config's description, for programs that are not built with CMake. Its prefix is where it
# stands, so that an installation may move.
file(RELATIVE_PATH gamer_pc_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
if(gamer_needs_mpi)
  set(gamer_pc_mpi " ompi-cxx")
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/gamer.pc.in ${CMAKE_CURRENT_BINARY_DIR}/gamer.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/gamer.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
