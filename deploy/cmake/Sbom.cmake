# cmake --build ... --target sbom: what the programs are made of, as SPDX 2.3.
find_program(PYTHON3 python3 PATHS /usr/bin NO_DEFAULT_PATH)
set(sbom ${CMAKE_BINARY_DIR}/penumbra.spdx.json)
add_custom_target(sbom
    COMMAND ${PYTHON3} ${CMAKE_SOURCE_DIR}/deploy/sbom.py ${PROJECT_VERSION} ${sbom}
        $<TARGET_FILE:penumbra> $<TARGET_FILE:penumbra-encoder> $<TARGET_FILE:penumbra-worker>
    BYPRODUCTS ${sbom} VERBATIM)
