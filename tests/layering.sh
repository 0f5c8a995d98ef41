#!/bin/sh
# Who may include whom: levelset <- mapping <- apps, levelset <- render <- apps. Prints offenders.
cd "$1" || exit 1
bad=$( { grep -rnE '#include "(mapping|render|apps)/' levelset
         grep -rnE '#include "(render|apps)/' mapping
         grep -rnE '#include "(mapping|apps)/' render
         grep -rnE '#include "tests/' levelset mapping render apps
         grep -rlE '#include <(openvdb|nanovdb)/' --include='*.h' levelset mapping render apps |
           grep -vE '^levelset/vdb\.h$|_vdb\.h$'
         # Where a mesh must be walked or thinned, and nowhere else; one file tells the version.
         grep -rlE '#include <(CGAL|OpenMesh)/' levelset mapping render apps |
           grep -vE '^levelset/((convert|meshing)/[a-z_]+|library_version)\.cpp$'
       } 2>/dev/null )
[ -z "$bad" ] && exit 0
echo "$bad"
exit 1
