# Makes live_assets.cpp of the page's files: run as a script, -DOUT= -DNAMES= -DFILES= (lists of equal length).
set(text "// Made from the files of the live pages; do not edit.\n#include \"bench/live/live_assets.hpp\"\n\nnamespace rotorloop::live {\n")
foreach(name file IN ZIP_LISTS NAMES FILES)
  file(READ ${file} content)
  # Compilers take a string literal of 64 KB and less.
  string(LENGTH "${content}" length)
  if(length GREATER 65000)
    message(FATAL_ERROR "${file}: too long for a string literal")
  endif()
  string(APPEND text "const std::string_view ${name} = R\"live_asset(${content})live_asset\";\n")
endforeach()
string(APPEND text "}  // namespace rotorloop::live\n")
file(WRITE ${OUT} "${text}")
