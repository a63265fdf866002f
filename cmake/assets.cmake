# Makes a source file of text files, each a string of its own: run as a script, -DOUT= -DHEADER= -DNAMESPACE= -DNAMES= -DFILES= (lists of equal length).
set(text "// Made from the files of pages; do not edit.\n#include \"${HEADER}\"\n\nnamespace ${NAMESPACE} {\n")
foreach(name file IN ZIP_LISTS NAMES FILES)
  file(READ ${file} content)
  # Compilers take a string literal of 64 KB and less.
  string(LENGTH "${content}" length)
  if(length GREATER 65000)
    message(FATAL_ERROR "${file}: too long for a string literal")
  endif()
  string(APPEND text "const std::string_view ${name} = R\"page_asset(${content})page_asset\";\n")
endforeach()
string(APPEND text "}  // namespace ${NAMESPACE}\n")
file(WRITE ${OUT} "${text}")
