# What is installed where, and the Debian packages: `cpack` in the build directory of a release.
# A component is a package: server is penumbra, worker is penumbra-worker, blender is penumbra-blender.
set(units lib/systemd/system)
set(source ${CMAKE_SOURCE_DIR}/deploy)

install(TARGETS penumbra DESTINATION bin COMPONENT server)
install(TARGETS penumbra-encoder DESTINATION libexec/penumbra COMPONENT server)
install(TARGETS penumbra-worker DESTINATION bin COMPONENT worker)
install(FILES ${source}/systemd/penumbra.service ${source}/systemd/penumbra.socket
    DESTINATION ${units} COMPONENT server)
install(FILES ${source}/systemd/penumbra-worker.service DESTINATION ${units} COMPONENT worker)
install(FILES ${source}/systemd/penumbra.sysusers DESTINATION lib/sysusers.d RENAME penumbra.conf
    COMPONENT server)
install(FILES ${source}/penumbra.conf DESTINATION /etc/penumbra COMPONENT server)
install(FILES ${source}/completions/bash/penumbra
    DESTINATION share/bash-completion/completions COMPONENT server)
install(FILES ${source}/completions/zsh/_penumbra
    DESTINATION share/zsh/vendor-completions COMPONENT server)
install(FILES ${source}/completions/fish/penumbra.fish
    DESTINATION share/fish/vendor_completions.d COMPONENT server)
install(FILES ${source}/python/penumbra.py DESTINATION share/doc/penumbra/examples
    COMPONENT server)
install(FILES ${source}/slurm/penumbra-worker.sbatch DESTINATION share/doc/penumbra/examples/slurm
    COMPONENT server)
install(PROGRAMS ${source}/slurm/penumbra-slurm-scale DESTINATION share/doc/penumbra/examples/slurm
    COMPONENT server)
install(FILES ${source}/demo/spiral.json DESTINATION share/doc/penumbra/examples COMPONENT server)

# The client goes along: Blender knows nothing of other packages' modules.
install(FILES ${source}/blender/penumbra_render/__init__.py
    ${source}/blender/penumbra_render/engine.py ${source}/blender/penumbra_render/export.py
    ${source}/blender/penumbra_render/scene.py ${source}/python/penumbra.py
    DESTINATION share/blender/scripts/addons/penumbra_render COMPONENT blender)

# Debian wants manuals and changelogs compressed, without a time in them.
find_program(GZIP gzip REQUIRED)
function(install_compressed file directory name component)
    set(compressed ${CMAKE_BINARY_DIR}/packaging/${component}/${name}.gz)
    add_custom_command(OUTPUT ${compressed}
        COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/packaging/${component}
        COMMAND ${GZIP} -9 -n -c ${file} > ${compressed} DEPENDS ${file} VERBATIM)
    set_property(GLOBAL APPEND PROPERTY PEN_COMPRESSED ${compressed})
    install(FILES ${compressed} DESTINATION ${directory} COMPONENT ${component})
endfunction()

install_compressed(${source}/man/penumbra.1 share/man/man1 penumbra.1 server)
install_compressed(${source}/man/penumbra.conf.5 share/man/man5 penumbra.conf.5 server)
install_compressed(${source}/man/penumbra-scene.5 share/man/man5 penumbra-scene.5 server)
install_compressed(${source}/man/penumbra-worker.8 share/man/man8 penumbra-worker.8 worker)
foreach(pair IN ITEMS server:penumbra worker:penumbra-worker blender:penumbra-blender)
    string(REPLACE ":" ";" pair ${pair})
    list(GET pair 0 component)
    list(GET pair 1 package)
    install_compressed(${CMAKE_SOURCE_DIR}/CHANGELOG.md share/doc/${package} changelog ${component})
    install_compressed(${source}/debian/changelog share/doc/${package} changelog.Debian ${component})
    install(FILES ${source}/debian/copyright DESTINATION share/doc/${package}
        COMPONENT ${component})
endforeach()
get_property(compressed GLOBAL PROPERTY PEN_COMPRESSED)
add_custom_target(packaging ALL DEPENDS ${compressed})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON) # for what goes to /etc
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "Penumbra maintainers <maintainers@penumbra.invalid>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL server worker blender)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_SERVER_PACKAGE_NAME penumbra)
set(CPACK_DEBIAN_SERVER_PACKAGE_DEPENDS
    "penumbra-worker (= ${PROJECT_VERSION}-1), systemd | systemd-standalone-sysusers")
set(CPACK_DEBIAN_SERVER_DESCRIPTION "distributed tile render service
Takes scenes over HTTP, splits their frames into tiles, has worker processes
render them by distribution ray tracing, and serves the images.
.
This package has the coordinator and the command-line client; it runs a farm
on its own machine with penumbra-worker.")
set(CPACK_DEBIAN_WORKER_PACKAGE_NAME penumbra-worker)
set(CPACK_DEBIAN_WORKER_DESCRIPTION "distributed tile render service, worker
Renders tiles of frames for a Penumbra coordinator by distribution ray
tracing, on all cores of its machine.")
set(CPACK_DEBIAN_BLENDER_PACKAGE_NAME penumbra-blender)
set(CPACK_DEBIAN_BLENDER_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_BLENDER_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_BLENDER_PACKAGE_DEPENDS "blender (>= 3.4)")
set(CPACK_DEBIAN_BLENDER_PACKAGE_SUGGESTS penumbra)
set(CPACK_DEBIAN_BLENDER_DESCRIPTION "distributed tile render service, Blender add-on
Adds Penumbra to the render engines of Blender: F12 hands the scene to a
server, shows the image while it is rendered, and Esc cancels.")
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA ${source}/debian/server/postinst
    ${source}/debian/server/prerm ${source}/debian/server/postrm ${source}/debian/server/conffiles)
set(CPACK_DEBIAN_WORKER_PACKAGE_CONTROL_EXTRA ${source}/debian/worker/postinst
    ${source}/debian/worker/prerm ${source}/debian/worker/postrm)
include(CPack)
