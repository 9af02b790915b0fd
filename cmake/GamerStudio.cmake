# gstudio: the server, and the page that is embedded in it.
set(gamer_page ${CMAKE_CURRENT_SOURCE_DIR}/studio)
set(gamer_page_code ${CMAKE_CURRENT_BINARY_DIR}/studio/page_files.cc)
file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/studio)
file(GLOB gamer_page_files CONFIGURE_DEPENDS ${gamer_page}/*.html ${gamer_page}/*.css ${gamer_page}/*.js
     ${gamer_page}/*.svg ${gamer_page}/*.glsl)
add_custom_command(OUTPUT ${gamer_page_code}
  COMMAND ${CMAKE_COMMAND} -DFOLDER=${gamer_page} -DOUTPUT=${gamer_page_code}
          -P ${CMAKE_CURRENT_SOURCE_DIR}/cmake/EmbedPage.cmake
  DEPENDS ${gamer_page_files} ${CMAKE_CURRENT_SOURCE_DIR}/cmake/EmbedPage.cmake VERBATIM)

gamer_add_layer(studio LINK PUBLIC gamer_job PRIVATE fmt::fmt tomlplusplus::tomlplusplus
                nlohmann_json::nlohmann_json Threads::Threads ZLIB::ZLIB $<BUILD_INTERFACE:Boost::headers>
                $<BUILD_INTERFACE:CLI11::CLI11>)
target_sources(gamer_studio PRIVATE ${gamer_page_code})
set_source_files_properties(${gamer_page_code} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)

add_executable(gstudio apps/gstudio.cpp)
target_link_libraries(gstudio PRIVATE gamer_studio CLI11::CLI11 fmt::fmt gamer_options)
