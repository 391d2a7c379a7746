# Defines the targets Catenary::catenary, the shared library, and Catenary::static.
get_filename_component(_catenary_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET Catenary::catenary)
  find_package(Threads REQUIRED)
  add_library(Catenary::catenary SHARED IMPORTED)
  set_target_properties(Catenary::catenary PROPERTIES
    IMPORTED_LOCATION "${_catenary_prefix}/lib/libcatenary.so"
    IMPORTED_NO_SONAME TRUE
    INTERFACE_INCLUDE_DIRECTORIES "${_catenary_prefix}/include")
  add_library(Catenary::static STATIC IMPORTED)
  set_target_properties(Catenary::static PROPERTIES
    IMPORTED_LOCATION "${_catenary_prefix}/lib/libcatenary.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_catenary_prefix}/include"
    INTERFACE_LINK_LIBRARIES "Threads::Threads;m;${CMAKE_DL_LIBS}")
endif()
unset(_catenary_prefix)
