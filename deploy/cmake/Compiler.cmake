# pen_flags: what every target of ours is compiled and linked with.
add_library(pen_flags INTERFACE)
target_include_directories(pen_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_definitions(pen_flags INTERFACE _GNU_SOURCE PEN_VERSION="${PROJECT_VERSION}")
target_compile_options(pen_flags INTERFACE
    -Wall -Wextra -Wshadow -Wconversion -Wundef -Wformat=2 -Wvla -Wwrite-strings -Wcast-qual
    -Wdouble-promotion -Wimplicit-fallthrough -Wnull-dereference
    $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Werror=implicit
        -Werror=incompatible-pointer-types -Werror=int-conversion>
    -ffp-contract=off -fno-math-errno -fno-strict-aliasing
    -ffile-prefix-map=${CMAKE_SOURCE_DIR}=.
    $<$<BOOL:${PEN_WERROR}>:-Werror>)

# Asserts guard invariants in every build: a coordinator that is wrong stops and restarts.
foreach(language C CXX)
    string(REPLACE "-DNDEBUG" "" CMAKE_${language}_FLAGS_RELWITHDEBINFO "${CMAKE_${language}_FLAGS_RELWITHDEBINFO}")
    string(REPLACE "-DNDEBUG" "" CMAKE_${language}_FLAGS_RELEASE "${CMAKE_${language}_FLAGS_RELEASE}")
endforeach()

if(PEN_SANITIZE)
    target_compile_options(pen_flags INTERFACE -fsanitize=${PEN_SANITIZE}
        -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(pen_flags INTERFACE -fsanitize=${PEN_SANITIZE})
    target_compile_definitions(pen_flags INTERFACE PEN_SANITIZE)
endif()
if(PEN_FUZZ)
    # What is fuzzed must count its branches, not only the target that calls it.
    target_compile_options(pen_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()

# pen_hardening: everything but the renderer's hot files.
add_library(pen_hardening INTERFACE)
target_compile_options(pen_hardening INTERFACE
    -fstack-protector-strong -fstack-clash-protection -fcf-protection=full)
target_compile_definitions(pen_hardening INTERFACE $<$<COMPILE_LANGUAGE:CXX>:_GLIBCXX_ASSERTIONS>)
if(NOT PEN_SANITIZE) # which would not see what these make harmless
    target_compile_options(pen_hardening INTERFACE
        -fno-delete-null-pointer-checks -fno-strict-overflow
        $<$<C_COMPILER_ID:GNU>:-ftrivial-auto-var-init=zero>
        $<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=3>)
endif()
target_link_options(pen_hardening INTERFACE -pie -Wl,-z,relro,-z,now,-z,noexecstack,--as-needed)
