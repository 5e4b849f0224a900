# What every target shares: the language, the flags, the libraries, and one function that makes a folder a library.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)  # the static libraries also go into the Python module
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

find_program(CCACHE ccache)
if(CCACHE)
  # Paths below the base count as relative, so that another clone of the same sources finds what this one has compiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} ${CCACHE})
endif()

# The same frame on every x86-64 machine: no contraction into fused multiply-add, no flags of the local processor
# (Debian's Eigen users, Ceres and Open3D, share Eigen types with us and are built for plain x86-64).
add_compile_options(-Wall -Wextra -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  add_compile_options(-Wno-restrict)  # false alarms in std::string: https://gcc.gnu.org/PR105651
endif()
if(RUGAE_WERROR)
  add_compile_options(-Werror)
endif()
if(RUGAE_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()

find_package(Eigen3 3.4 REQUIRED)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(OpenSSL REQUIRED)
find_package(TBB REQUIRED)
find_package(embree 3.13 REQUIRED)
find_package(assimp REQUIRED)
find_package(TinyGLTF REQUIRED)
find_package(OpenImageIO REQUIRED)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs calib3d features2d video photo stitching objdetect)
find_package(dlib REQUIRED)
find_package(Ceres REQUIRED)
find_package(Open3D REQUIRED)
find_package(CLI11 REQUIRED)
find_path(RANDOM123_INCLUDE Random123/philox.h REQUIRED)

# rugae_library(<folder> [PUBLIC lib...] [PRIVATE lib...] [PCH header...]): every .cpp of this folder and below becomes
# librugae_<folder>, alias rugae::<folder>. PUBLIC are libraries whose types appear in our headers.
function(rugae_library name)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE;PCH" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  add_library(rugae_${name} STATIC ${sources})
  add_library(rugae::${name} ALIAS rugae_${name})
  target_include_directories(rugae_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(rugae_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  if(RUGAE_PCH AND ARG_PCH)
    target_precompile_headers(rugae_${name} PRIVATE ${ARG_PCH})
  endif()
endfunction()
