# Compiles the mutated files outside the unity build, so that a mutant rebuilds one object.
# Read by project(); the modules' folders exist when the deferred calls run.
foreach(file IN LISTS LEVELSMITH_MUTATED)
  string(REGEX MATCH "^[a-z]+" module ${file})
  cmake_language(DEFER CALL set_source_files_properties ${CMAKE_SOURCE_DIR}/${file} DIRECTORY ${CMAKE_SOURCE_DIR}/${module}
                 PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endforeach()
