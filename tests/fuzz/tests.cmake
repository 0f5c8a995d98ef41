# Two seconds for each reader: its stored inputs and some thousand mutations of them. Ten minutes under `slow`. The
# program is built by a test before them, as the consumer is: by another compiler, from modules of this build.
# `./dev test` builds it earlier, so that its time counts to the build.
set(fuzz_readers
  ply obj stl off points points_ply points_obj points_vdb gzip vdb nvdb nifti metaimage nrrd mrc asc bil tiles png exr heights
  patch lattice bezier quadrics pdb cif scene cache graph script chain formula)
set(fuzz_program ${PROJECT_SOURCE_DIR}/build/fuzz/tests/fuzz/levelsmith_fuzz)
add_test(NAME fuzz.build COMMAND ${CMAKE_CURRENT_LIST_DIR}/build.sh ${PROJECT_BINARY_DIR})
set_tests_properties(fuzz.build PROPERTIES TIMEOUT 1200 SKIP_RETURN_CODE 77 FIXTURES_SETUP fuzz COST 90)
foreach(reader IN LISTS fuzz_readers)
  add_test(NAME fuzz.${reader} COMMAND ${CMAKE_CURRENT_LIST_DIR}/run.sh ${fuzz_program} ${reader} 2)
  add_test(NAME fuzz.${reader}.slow COMMAND ${CMAKE_CURRENT_LIST_DIR}/run.sh ${fuzz_program} ${reader} 600)
  set_tests_properties(fuzz.${reader} fuzz.${reader}.slow PROPERTIES
                       FIXTURES_REQUIRED fuzz SKIP_RETURN_CODE 77)
  set_tests_properties(fuzz.${reader} PROPERTIES TIMEOUT 120)
  set_tests_properties(fuzz.${reader}.slow PROPERTIES TIMEOUT 900 LABELS slow)
endforeach()
