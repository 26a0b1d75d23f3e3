# Each library is one imported target, linked only by the target of the file that uses it.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
foreach(name IN ITEMS jansson libmicrohttpd libuv libprotobuf-c sqlite3 libxxhash gnutls libseccomp libcurl libsystemd OpenImageIO)
    string(REGEX REPLACE "^lib" "" short ${name})
    pkg_check_modules(${short} REQUIRED IMPORTED_TARGET ${name})
endforeach()
find_package(embree 3.13 REQUIRED)
# Headers alone: tinygltf is compiled without its image decoder and its files.
find_path(TINYGLTF_INCLUDE tiny_gltf.h REQUIRED)
find_path(NLOHMANN_JSON_INCLUDE nlohmann/json.hpp REQUIRED)
find_program(PROTOC_C protoc-c REQUIRED)
