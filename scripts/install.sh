#!/usr/bin/env bash
# Puts a release build in place; called by `make install`, which sets the variables.
#   BUILT    folder with the built files            VERSION  of the library
#   PREFIX   where to                               DESTDIR  goes before it, in no file's text: for packagers
set -euo pipefail
: "${BUILT:?}" "${VERSION:?}" "${PREFIX:?}"

case $PREFIX in /*) ;; *) echo "install: PREFIX is '$PREFIX'; an absolute path was expected" >&2; exit 1 ;; esac
pre=${DESTDIR:-}$PREFIX
lib=$pre/lib
major=${VERSION%%.*}

install -D -m 755 "$BUILT/caustica" "$pre/bin/caustica"
install -D -m 644 include/caustica.h "$pre/include/caustica.h"
install -D -m 755 "$BUILT/libcaustica.so" "$lib/libcaustica.so.$VERSION"
ln -sf "libcaustica.so.$VERSION" "$lib/libcaustica.so.$major"
ln -sf "libcaustica.so.$major" "$lib/libcaustica.so"
# Image formats beside EXR; opened when one is first needed.
module=$BUILT/libcaustica_oiio.so
[ ! -e "$module" ] || install -D -m 755 "$module" "$lib/caustica/libcaustica_oiio.so"
install -D -m 644 -t "$pre/share/doc/caustica" README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE
scripts/notices.sh >"$pre/share/doc/caustica/THIRD-PARTY.txt"

# Relative to the files themselves, so that the installation can be moved as a whole.
mkdir -p "$lib/pkgconfig" "$lib/cmake/caustica"
cat >"$lib/pkgconfig/caustica.pc" <<END
prefix=\${pcfiledir}/../..
libdir=\${prefix}/lib
includedir=\${prefix}/include

Name: caustica
Description: Renders refractive caustics by bidirectional path tracing
Version: $VERSION
Cflags: -I\${includedir}
Libs: -L\${libdir} -lcaustica
END
cat >"$lib/cmake/caustica/causticaConfig.cmake" <<END
# find_package(caustica) gives the target caustica::caustica.
get_filename_component(_caustica_prefix "\${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET caustica::caustica)
  add_library(caustica::caustica SHARED IMPORTED)
  set_target_properties(caustica::caustica PROPERTIES
    IMPORTED_LOCATION "\${_caustica_prefix}/lib/libcaustica.so.$VERSION"
    IMPORTED_SONAME "libcaustica.so.$major"
    INTERFACE_INCLUDE_DIRECTORIES "\${_caustica_prefix}/include")
endif()
unset(_caustica_prefix)
END
# Before 1.0 only the same minor version is compatible.
cat >"$lib/cmake/caustica/causticaConfigVersion.cmake" <<END
set(PACKAGE_VERSION "$VERSION")
if(PACKAGE_FIND_VERSION VERSION_EQUAL PACKAGE_VERSION)
  set(PACKAGE_VERSION_EXACT TRUE)
endif()
string(REGEX MATCH "^[0-9]+\\\\.[0-9]+" _caustica_minor "\${PACKAGE_VERSION}")
string(REGEX MATCH "^[0-9]+\\\\.[0-9]+" _caustica_wanted "\${PACKAGE_FIND_VERSION}.0")
if(_caustica_minor STREQUAL _caustica_wanted AND NOT PACKAGE_FIND_VERSION VERSION_GREATER PACKAGE_VERSION)
  set(PACKAGE_VERSION_COMPATIBLE TRUE)
else()
  set(PACKAGE_VERSION_COMPATIBLE FALSE)
endif()
unset(_caustica_minor)
unset(_caustica_wanted)
END

# The dynamic linker's cache, where this is an installation in place.
if [ -z "${DESTDIR:-}" ] && [ "$(id -u)" -eq 0 ]; then ldconfig; fi
echo "installed: $pre/bin/caustica, $pre/include/caustica.h, $lib/libcaustica.so.$VERSION"
