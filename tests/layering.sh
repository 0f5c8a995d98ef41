#!/bin/sh
# Who may include whom: levelset <- mapping <- apps, levelset <- render <- apps. Prints offenders.
cd "$1" || exit 1
bad=$( { grep -rnE '#include "(mapping|render|apps)/' levelset
         grep -rnE '#include "(render|apps)/' mapping
         grep -rnE '#include "(mapping|apps)/' render
         grep -rnE '#include "tests/' levelset mapping render apps
         grep -rlE '#include <(openvdb|nanovdb)/' --include='*.h' levelset mapping render apps |
           grep -vE '^levelset/vdb\.h$|_vdb\.h$'
         grep -rnE '#include <(CGAL|OpenMesh)/' --include='*.h' levelset mapping render apps
       } 2>/dev/null )
[ -z "$bad" ] && exit 0
echo "$bad"
exit 1
