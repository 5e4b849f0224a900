# Asks a test program for its suites and writes one ctest test each; a program takes half a second to load what it is linked
# with, which hundreds of tests by themselves would pay each time, and what a suite prepares it prepares once.
# cmake -D PROGRAM= -D FOLDER= -D EXCEPT= -D PROPERTIES= -D OUT= -P discover_suites.cmake
# EXCEPT is a filter of GoogleTest for what is left out; PROPERTIES are those of all tests.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests --gtest_filter=-${EXCEPT} OUTPUT_VARIABLE listed RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${failed}")
endif()
string(REPLACE ";" "\\;" listed "${listed}")
string(REPLACE "\n" ";" lines "${listed}")
set(text "")
foreach(line IN LISTS lines)
  # "Suite." or "Instantiation/Suite." or "Suite/0.  # TypeParam = ..."; tests are indented.
  if(line MATCHES "^([A-Za-z0-9_/]+)\\.")
    set(suite ${CMAKE_MATCH_1})
    string(APPEND text "add_test([=[${FOLDER}.${suite}]=] \"${PROGRAM}\" \"--gtest_filter=${suite}.*:-${EXCEPT}\")\n"
      "set_tests_properties([=[${FOLDER}.${suite}]=] PROPERTIES ${PROPERTIES})\n")
  endif()
endforeach()
if(text STREQUAL "")
  message(FATAL_ERROR "${PROGRAM} has no tests")
endif()
file(WRITE ${OUT} "${text}")
