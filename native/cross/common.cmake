# What Debian's cross compilers share. What they build is only tried, so it is compiled in half the time.
set(CMAKE_CXX_FLAGS_RELEASE "-O1 -DNDEBUG" CACHE STRING "")

# Eigen and Boost are headers for any machine, but of the folder that
# Boost lies in, /usr/include, everything else is of this machine alone.
get_filename_component(cross_headers "${CMAKE_CURRENT_LIST_DIR}/../../build/cross/include" ABSOLUTE)
file(MAKE_DIRECTORY "${cross_headers}")
if(NOT EXISTS "${cross_headers}/boost")
  file(CREATE_LINK /usr/include/boost "${cross_headers}/boost" SYMBOLIC)
endif()
set(Boost_NO_BOOST_CMAKE ON)
set(Boost_INCLUDE_DIR "${cross_headers}")
