# Manual pages and completions, which the programs print from their declarations when they are built.
set(gamer_manuals ${CMAKE_CURRENT_BINARY_DIR}/manuals)
file(MAKE_DIRECTORY ${gamer_manuals})
# A build inside a batch job is no rank of it: these are the variables of src/parallel/mpi/mpi_group.cc.
# Leaks cannot be looked for in every container.
set(gamer_alone ${CMAKE_COMMAND} -E env ASAN_OPTIONS=detect_leaks=0)
foreach(variable OMPI_COMM_WORLD_SIZE PMIX_RANK PMI_RANK PMI_SIZE MV2_COMM_WORLD_SIZE ALPS_APP_PE PALS_RANKID)
  list(APPEND gamer_alone --unset=${variable})
endforeach()
set(gamer_programs gamer gutil)
if(TARGET gstudio)
  list(APPEND gamer_programs gstudio)
endif()
foreach(program ${gamer_programs})
  foreach(format man bash zsh)
    add_custom_command(TARGET ${program} POST_BUILD
      COMMAND ${gamer_alone} $<TARGET_FILE:${program}> --print-manual ${format}
              > ${gamer_manuals}/${program}.${format}
      BYPRODUCTS ${gamer_manuals}/${program}.${format} VERBATIM)
  endforeach()
endforeach()
