# One package, echorama, that holds every class.
set(package_modules ${modules})
list(TRANSFORM package_modules REPLACE "::" "")
list(TRANSFORM package_modules PREPEND "from .")
list(TRANSFORM package_modules APPEND " import *")
list(JOIN package_modules "\n" package_imports)
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${ECHORAMA_PYTHON_PACKAGES}/echorama/__init__.py CONTENT
"\"\"\"Echorama: large ultrasound volumes out of many small ones. Every class of every module.\"\"\"
@package_imports@
" @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/${ECHORAMA_PYTHON_PACKAGES}/echorama/__init__.py
  DESTINATION ${ECHORAMA_PYTHON_PACKAGES}/echorama)
# What one builds to have it. Wrappers are compiled longer than they run.
foreach(module IN LISTS modules)
  string(REPLACE "::" "" target ${module}Python)
  target_compile_options(${target} PRIVATE -O1)
  add_dependencies(python ${target})
endforeach()
