#!/bin/sh
# Who may include whom: levelset <- mapping <- apps, levelset <- render <- apps; folders have no cycles and at
# most 20 files (layering.py). Prints offenders. layering.sh ROOT
here=$(cd "$(dirname "$0")" && pwd)
cd "$1" || exit 1
status=0
"$here/layering.py" . || status=1
bad=$( { grep -rnE '#include "(mapping|render|apps)/' levelset
         grep -rnE '#include "(render|apps)/' mapping
         grep -rnE '#include "(mapping|apps)/' render
         grep -rnE '#include "tests/' levelset mapping render apps
         grep -rlE '#include <(openvdb|nanovdb)/' --include='*.h' levelset mapping render apps |
           grep -vE '^levelset/vdb\.h$|_vdb\.h$'
         # CGAL and OpenMesh only in conversion, meshing and the Delaunay tetrahedra; library_version.cpp reports versions.
         grep -rlE '#include <(CGAL|OpenMesh)/' levelset mapping render apps |
           grep -vE '^levelset/((convert|meshing)/[a-z_]+|points/projection/delaunay|library_version)\.cpp$'
       } 2>/dev/null )
[ -z "$bad" ] && exit $status
echo "$bad"
exit 1
