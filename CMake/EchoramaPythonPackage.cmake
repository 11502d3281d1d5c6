# One package, echorama, that has every class. A module is loaded with the first of its classes that is asked for: with all that they
# draw, deform and register with, the modules take ten times as long to load as Python to start.
set(package_classes)
foreach(module IN LISTS modules)
  string(REPLACE "::" "" library ${module})
  string(REPLACE "Echorama::" "" room ${module})
  get_property(classes GLOBAL PROPERTY ECHORAMA_CLASSES_OF_${room})
  list(JOIN classes " " classes)
  string(APPEND package_classes "    \"${library}\": \"${classes}\",\n")
endforeach()
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${ECHORAMA_PYTHON_PACKAGES}/echorama/__init__.py CONTENT
"\"\"\"Echorama: large ultrasound volumes out of many small ones. Every class of every module.\"\"\"
import importlib as _importlib

_classes = {
@package_classes@}
_module_of = {name: module for module, names in _classes.items() for name in names.split()}
__all__ = sorted([*_module_of, *_classes])


def __getattr__(name):
    module = _module_of.get(name, name)
    if module not in _classes:
        raise AttributeError(f\"module {__name__!r} has no attribute {name!r}\")
    loaded = _importlib.import_module(\".\" + module, __name__)
    globals().update((each, getattr(loaded, each)) for each in _classes[module].split())
    return globals()[name]


def __dir__():
    return sorted({*globals(), *__all__})
" @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/${ECHORAMA_PYTHON_PACKAGES}/echorama/__init__.py
  DESTINATION ${ECHORAMA_PYTHON_PACKAGES}/echorama COMPONENT python)
# What one builds to have it. Wrappers are compiled longer than they run.
foreach(module IN LISTS modules)
  string(REPLACE "::" "" target ${module}Python)
  target_compile_options(${target} PRIVATE -O1)
  add_dependencies(python ${target})
endforeach()
