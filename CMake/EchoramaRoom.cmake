# echorama_add_room(NAME
#   [KERNEL_DEPENDS room...]      rooms whose kernels ours call
#   [KERNEL_LIBRARIES target...]  further libraries, private to the kernels
#   [KERNEL_DEFINITIONS name...] [KERNEL_OPTIONS option...] for compiling the kernels
#   [KERNEL_SUBDIRECTORIES dir...] where the kernels lie, default: the room's own folder
#   [CLASSES class...]            vtk classes, by path without extension
#   [UNWRAPPED class...]          the same, for C++ alone
#   [VTK_LIBRARIES target...]     further libraries, private to the vtk classes
#   [FUZZED file...]              kernels whose branches the fuzzers follow, default: all of a room with fuzzers
#   [BENCHMARK_DEPENDS room...])  other rooms whose kernels the benchmarks use; without them they are left out
#
# A room is two layers. Kernels (every .cxx whose name does not begin with vtk) become lib<Echorama><NAME>Kernels,
# which links no VTK; the vtk classes become the VTK module Echorama::NAME over it. Tests and benchmarks are found by
# their place and name: Testing/Test*.cxx (GoogleTest), Testing/Test*.py (wrapped classes),
# Benchmarks/Benchmark*.cxx, Fuzzing/Fuzz*.cxx (libFuzzer). Other sources in Benchmarks are contestants: methods that are no part of the
# product, for its benchmarks and tests.
function(echorama_add_room name)
  cmake_parse_arguments(PARSE_ARGV 1 room "" "" "KERNEL_DEPENDS;KERNEL_LIBRARIES;KERNEL_DEFINITIONS;KERNEL_OPTIONS;KERNEL_SUBDIRECTORIES;CLASSES;UNWRAPPED;VTK_LIBRARIES;FUZZED;BENCHMARK_DEPENDS")
  if(NOT ECHORAMA_STACK STREQUAL "paraview")
    _echorama_add_kernels(${name})
  endif()
  if(NOT ECHORAMA_STACK STREQUAL "kernels" AND room_CLASSES)
    _echorama_add_classes(${name})
  endif()
  if(NOT ECHORAMA_STACK STREQUAL "paraview")
    _echorama_add_tests(${name})
  endif()
  if(ECHORAMA_FUZZING)
    _echorama_add_fuzzers(${name})
  endif()
endfunction()

# The library of a room's kernels, or another of the same name for CPUs of a level of x86-64.
macro(_echorama_add_kernel_library target level)
  add_dependencies(kernels ${target})
  add_library(${target} SHARED ${kernels})
  set_target_properties(${target} PROPERTIES OUTPUT_NAME Echorama${name}Kernels VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}
    # Kernels have no export macros: their whole interface is public.
    CXX_VISIBILITY_PRESET default VISIBILITY_INLINES_HIDDEN OFF
    # Templates of Eigen are instantiated once for several files. So no two kernels of a room may use one name for two things.
    UNITY_BUILD ${ECHORAMA_UNITY} UNITY_BUILD_BATCH_SIZE 6)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/echorama>)
  target_compile_features(${target} PUBLIC cxx_std_17)
  # Eigen's alignment, and whether it allocates with malloc alone, would follow each compiler call's instruction set; the interface
  # must not: what one side allocates the other frees.
  target_compile_definitions(${target} PUBLIC ${ECHORAMA_EIGEN_INTERFACE} PRIVATE ${room_KERNEL_DEFINITIONS})
  target_compile_options(${target} PRIVATE ${room_KERNEL_OPTIONS})
  target_link_libraries(${target} PUBLIC Eigen3::Eigen PRIVATE ${room_KERNEL_LIBRARIES})
  foreach(other IN LISTS room_KERNEL_DEPENDS)
    target_link_libraries(${target} PUBLIC Echorama::${other}Kernels)
  endforeach()
  echorama_compile_options(${target} ${level})
  echorama_precompile(${target} kernels ${level})
endmacro()

macro(_echorama_add_kernels name)
  if(NOT room_KERNEL_SUBDIRECTORIES)
    set(room_KERNEL_SUBDIRECTORIES .)
  endif()
  set(kernels)
  set(headers)
  foreach(directory IN LISTS room_KERNEL_SUBDIRECTORIES)
    file(GLOB found CONFIGURE_DEPENDS ${directory}/*.cxx)
    list(APPEND kernels ${found})
    file(GLOB found CONFIGURE_DEPENDS ${directory}/*.h)
    list(APPEND headers ${found})
  endforeach()
  list(FILTER kernels EXCLUDE REGEX "/vtk[^/]*$")
  list(FILTER headers EXCLUDE REGEX "/vtk[^/]*$")

  set(target ${name}Kernels)
  _echorama_add_kernel_library(${target} "")
  add_library(Echorama::${target} ALIAS ${target})
  install(TARGETS ${target} EXPORT EchoramaKernels LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} NAMELINK_COMPONENT development)
  foreach(level IN LISTS ECHORAMA_CPU_LEVELS)
    # The dynamic loader prefers a library in glibc-hwcaps/LEVEL to the one beside that folder.
    set(folder glibc-hwcaps/${level})
    _echorama_add_kernel_library(${target}_${level} ${level})
    set_target_properties(${target}_${level} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/${folder}
      INSTALL_RPATH "$ORIGIN/../..")
    add_dependencies(${target} ${target}_${level}) # what is loaded is never older than what was built
    install(TARGETS ${target}_${level} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/${folder} NAMELINK_SKIP)
  endforeach()
  foreach(header IN LISTS headers)
    file(RELATIVE_PATH place ${PROJECT_SOURCE_DIR} ${header})
    get_filename_component(place ${place} DIRECTORY)
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/echorama/${place} COMPONENT development)
  endforeach()
  set_property(GLOBAL APPEND PROPERTY ECHORAMA_KERNEL_TARGETS ${target})
endmacro()

macro(_echorama_add_classes name)
  vtk_module_add_module(Echorama::${name} CLASSES ${room_CLASSES} NOWRAP_CLASSES ${room_UNWRAPPED})
  list(TRANSFORM room_CLASSES REPLACE ".*/" "" OUTPUT_VARIABLE wrapped)
  set_property(GLOBAL PROPERTY ECHORAMA_CLASSES_OF_${name} ${wrapped}) # for the Python package
  vtk_module_link(Echorama::${name} PUBLIC Echorama::${name}Kernels PRIVATE ${room_VTK_LIBRARIES})
  # Classes may lie in subfolders (Core/Pipeline); they are included by their bare names all the same. Installed, they lie in
  # one folder.
  set(directories)
  foreach(class IN LISTS room_CLASSES)
    get_filename_component(directory ${class} DIRECTORY)
    list(APPEND directories ${directory})
  endforeach()
  list(REMOVE_DUPLICATES directories)
  foreach(directory IN LISTS directories)
    vtk_module_include(Echorama::${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/${directory}>)
  endforeach()
  _vtk_module_real_target(module_target Echorama::${name})
  echorama_compile_options(${module_target})
  target_compile_options(${module_target} PRIVATE -O1) # nothing here is hot: that lies in the kernels
  if(ECHORAMA_STACK STREQUAL "paraview")
    target_compile_definitions(${module_target} PRIVATE ECHORAMA_JSON="Plugin/VtkJson.h")
  endif()
  echorama_precompile(${module_target} classes)
endmacro()

macro(_echorama_add_tests name)
  file(GLOB contestants CONFIGURE_DEPENDS Benchmarks/*.cxx)
  list(FILTER contestants EXCLUDE REGEX "/Benchmark[^/]*$")
  if(contestants)
    add_library(${name}Contestants STATIC EXCLUDE_FROM_ALL ${contestants})
    target_link_libraries(${name}Contestants PUBLIC Echorama::${name}Kernels)
    echorama_compile_options(${name}Contestants)
  endif()
  if(ECHORAMA_TESTING)
    file(GLOB tests CONFIGURE_DEPENDS Testing/Test*.cxx)
    if(tests)
      if(ECHORAMA_TESTS_DIR)
        set(program ${ECHORAMA_TESTS_DIR}/bin/${name}Tests)
      else()
        set(program ${name}Tests)
        add_executable(${name}Tests EXCLUDE_FROM_ALL ${tests})
        add_dependencies(tests ${name}Tests)
        target_link_libraries(${name}Tests PRIVATE Echorama::${name}Kernels ${room_KERNEL_LIBRARIES} GTest::gtest_main ${CMAKE_DL_LIBS})
        if(TARGET ${name}Contestants)
          target_link_libraries(${name}Tests PRIVATE ${name}Contestants)
        endif()
        target_compile_definitions(${name}Tests PRIVATE ECHORAMA_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
        echorama_compile_options(${name}Tests)
        target_compile_options(${name}Tests PRIVATE -O1) # tests are compiled longer than they run
        echorama_precompile(${name}Tests tests)
      endif()
      # In shards, so that all cores are busy to the end: one for every four files.
      list(LENGTH tests shards)
      math(EXPR shards "(${shards} + 3) / 4")
      foreach(shard RANGE 1 ${shards})
        set(test ${name}.shard${shard})
        math(EXPR index "${shard} - 1")
        add_test(NAME ${test} COMMAND ${program})
        set_tests_properties(${test} PROPERTIES LABELS "kernel;reports" TIMEOUT 900
          ENVIRONMENT "GTEST_TOTAL_SHARDS=${shards};GTEST_SHARD_INDEX=${index};GTEST_OUTPUT=xml:${ECHORAMA_TEST_REPORTS}/${test}.xml")
        if(ECHORAMA_TESTS_DIR)
          set_property(TEST ${test} APPEND PROPERTY ENVIRONMENT ${ECHORAMA_TESTS_ENVIRONMENT})
        endif()
        if(name MATCHES "^Tracking") # devices that deliver by the clock
          set_property(TEST ${test} APPEND PROPERTY LABELS live)
        endif()
      endforeach()
    endif()
    if(ECHORAMA_STACK STREQUAL "vtk")
      file(GLOB tests CONFIGURE_DEPENDS Testing/Test*.py)
      foreach(test IN LISTS tests)
        echorama_add_python_test(${test})
      endforeach()
    endif()
  endif()
  if(ECHORAMA_BENCHMARKS)
    file(GLOB benchmarks CONFIGURE_DEPENDS Benchmarks/Benchmark*.cxx)
    string(REPLACE "/" "" rooms "${ECHORAMA_ROOMS}") # the other's targets may come later
    foreach(other IN LISTS room_BENCHMARK_DEPENDS)
      if(NOT other IN_LIST rooms)
        message(STATUS "The benchmarks of ${name} are left out: they need ${other}")
        set(benchmarks)
      endif()
    endforeach()
    foreach(benchmark IN LISTS benchmarks)
      echorama_add_benchmark(${benchmark} ${name} ${room_BENCHMARK_DEPENDS})
    endforeach()
  endif()
endmacro()

# One program per decoder that reads what it should not trust. As a test it runs for ECHORAMA_FUZZ_SECONDS, from the files
# that Fuzzing/Seeds<Name>.py writes to the folder it is given and from the inputs in Fuzzing/Corpus<Name>.zip.
macro(_echorama_add_fuzzers name)
  file(GLOB fuzzers CONFIGURE_DEPENDS Fuzzing/Fuzz*.cxx)
  # clang takes a precompiled header only with the sanitizers that it was made with.
  if(room_FUZZED)
    set_property(SOURCE ${room_FUZZED} APPEND PROPERTY COMPILE_OPTIONS -fsanitize=fuzzer-no-link)
    set_property(SOURCE ${room_FUZZED} PROPERTY SKIP_PRECOMPILE_HEADERS ON)
  elseif(fuzzers)
    target_compile_options(${name}Kernels PRIVATE -fsanitize=fuzzer-no-link)
    set_property(TARGET ${name}Kernels PROPERTY DISABLE_PRECOMPILE_HEADERS ON)
  endif()
  foreach(fuzzer IN LISTS fuzzers)
    get_filename_component(target ${fuzzer} NAME_WE)
    add_executable(${target} EXCLUDE_FROM_ALL ${fuzzer})
    add_dependencies(tests ${target})
    target_link_libraries(${target} PRIVATE Echorama::${name}Kernels)
    target_link_options(${target} PRIVATE -fsanitize=fuzzer)
    echorama_compile_options(${target})
    set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/fuzzers)
    add_test(NAME Fuzz.${target} COMMAND ${PROJECT_SOURCE_DIR}/Testing/fuzz.py $<TARGET_FILE:${target}> ${fuzzer}
      ${ECHORAMA_FUZZ_SECONDS})
    set_tests_properties(Fuzz.${target} PROPERTIES LABELS fuzz TIMEOUT 300)
  endforeach()
endmacro()

# echorama_add_benchmark(FILE ROOM [other rooms...]): one program per file over the rooms' kernels; the vtk stack's may use
# VTK as the peer.
function(echorama_add_benchmark file name)
  get_filename_component(target ${file} NAME_WE)
  add_executable(${target} EXCLUDE_FROM_ALL ${file})
  add_dependencies(benchmarks ${target})
  target_link_libraries(${target} PRIVATE Echorama::${name}Kernels TBB::tbb nlohmann_json::nlohmann_json)
  if(TARGET ${name}Contestants)
    target_link_libraries(${target} PRIVATE ${name}Contestants)
  endif()
  foreach(other IN LISTS ARGN)
    target_link_libraries(${target} PRIVATE Echorama::${other}Kernels)
  endforeach()
  if(ECHORAMA_STACK STREQUAL "vtk")
    target_link_libraries(${target} PRIVATE ${VTK_LIBRARIES})
    target_compile_definitions(${target} PRIVATE ECHORAMA_WITH_VTK)
  endif()
  target_compile_definitions(${target} PRIVATE ECHORAMA_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  echorama_compile_options(${target})
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/benchmarks)
  if(ECHORAMA_TESTING) # that it starts and reports
    set(screen)
    if(target IN_LIST ECHORAMA_TESTS_ON_SCREEN)
      echorama_on_screen(screen)
    endif()
    string(REPLACE "Benchmark" "Benchmark." test ${target})
    add_test(NAME ${test} COMMAND ${screen} /usr/bin/python3 ${PROJECT_SOURCE_DIR}/Testing/smoke.py $<TARGET_FILE:${target}>)
    set_tests_properties(${test} PROPERTIES LABELS benchmark TIMEOUT 600 SKIP_RETURN_CODE 77)
  endif()
endfunction()

# Tests run beside each other: each that draws has an X screen of its own. The numbers begin elsewhere in every build tree; should
# one be taken all the same, xvfb-run takes the next.
# echorama_on_screen(VARIABLE): the words before a command that give it such a screen.
function(echorama_on_screen variable)
  get_property(number GLOBAL PROPERTY ECHORAMA_SCREEN)
  if(NOT number)
    string(MD5 number ${CMAKE_BINARY_DIR})
    string(SUBSTRING ${number} 0 2 number)
    math(EXPR number "200 + 100 * 0x${number}")
  endif()
  # Without -noreset the screen is gone for a moment whenever its last client leaves.
  set(${variable} xvfb-run -a -n ${number} -s "-screen 0 1600x1200x24 -noreset" PARENT_SCOPE)
  math(EXPR number "${number} + 1")
  set_property(GLOBAL PROPERTY ECHORAMA_SCREEN ${number})
endfunction()
set(ECHORAMA_TESTS_ON_SCREEN TestCommandLine TestDemo TestDemoSurface TestExamples TestUltrasoundAlignmentWidget TestUltrasoundSliceView
  TestUltrasoundVolumeView BenchmarkVolumeView BenchmarkWorkbench)
# Left to ./run test --all (and to -R, which runs what it names): a fifth of the time of all tests.
set(ECHORAMA_SLOW_TESTS TestAlignmentVerdicts TestDemo TestExamples TestSite TestTutorials)
# The others follow by the time that they took before, as ctest remembers it.
set(ECHORAMA_TESTS_STARTED_FIRST TestCommandLine TestDataContract ${ECHORAMA_SLOW_TESTS})

# Where tests leave reports of their single tests; Testing/run_tests.py reads those of the tests labelled "reports".
set(ECHORAMA_TEST_REPORTS ${CMAKE_BINARY_DIR}/Testing/reports)
file(MAKE_DIRECTORY ${ECHORAMA_TEST_REPORTS})

# echorama_add_python_test(FILE [args...]): a test on the wrapped classes; exit status 77 means skipped.
function(echorama_add_python_test file)
  get_filename_component(test ${file} NAME_WE)
  set(screen)
  if(test IN_LIST ECHORAMA_TESTS_ON_SCREEN)
    echorama_on_screen(screen)
  endif()
  add_test(NAME Python.${test} COMMAND ${screen} ${ECHORAMA_PYTHON} ${PROJECT_SOURCE_DIR}/Testing/python_test.py
    ${ECHORAMA_TEST_REPORTS}/Python.${test}.xml ${file} ${ARGN})
  set_tests_properties(Python.${test} PROPERTIES LABELS "python;reports" TIMEOUT 900 SKIP_RETURN_CODE 77
    ENVIRONMENT "PYTHONPATH=${ECHORAMA_PYTHON_PATH}:${PROJECT_SOURCE_DIR}/Testing;ECHORAMA_SOURCE_DIR=${PROJECT_SOURCE_DIR};ECHORAMA_BUILD_DIR=${CMAKE_BINARY_DIR}")
  if(test IN_LIST ECHORAMA_SLOW_TESTS)
    set_property(TEST Python.${test} APPEND PROPERTY LABELS slow)
  endif()
  if(test IN_LIST ECHORAMA_TESTS_STARTED_FIRST)
    set_tests_properties(Python.${test} PROPERTIES COST 1000)
  endif()
endfunction()
