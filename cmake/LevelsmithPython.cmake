# Finds the packages that only the Python module needs. Without them the module is not built.

# A sanitizer would have to be linked into the interpreter.
if(LEVELSMITH_SANITIZE)
  set(LEVELSMITH_PYTHON OFF)
  return()
endif()

# Prefer Debian's Python, which has the packages, to other interpreters in PATH.
if(NOT Python_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3)
endif()
find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
if(Python_FOUND)
  find_package(pybind11 CONFIG QUIET)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env --unset=PYTHONPATH ${Python_EXECUTABLE} -c "import numpy"
                  RESULT_VARIABLE lacks_numpy ERROR_QUIET)
endif()
if(NOT Python_FOUND OR NOT pybind11_FOUND OR NOT lacks_numpy EQUAL 0)
  message(STATUS "The Python module is not built: it needs pybind11-dev, python3-dev and python3-numpy")
  set(LEVELSMITH_PYTHON OFF)
endif()
