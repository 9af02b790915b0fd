# Manual pages and completions, which the programs print from their declarations when they are built.
set(gamer_manuals ${CMAKE_CURRENT_BINARY_DIR}/manuals)
file(MAKE_DIRECTORY ${gamer_manuals})
foreach(program gamer gutil)
  foreach(format man bash zsh)
    add_custom_command(TARGET ${program} POST_BUILD
      COMMAND ${program} --print-manual ${format} > ${gamer_manuals}/${program}.${format}
      BYPRODUCTS ${gamer_manuals}/${program}.${format} VERBATIM)
  endforeach()
endforeach()
