#!/bin/sh
# Compares the CPU seconds from a volume file to a picture of an isosurface with those of VTK, on one thread: flying edges and
# OpenGL; its ray caster of isosurfaces; its fixed-point ray caster with a step of opacity; flying edges and Embree. OpenGL is
# Mesa's llvmpipe. The times of VTK begin after its start-up. Exits 1 when a picture takes more than half the time of VTK's ray
# caster of isosurfaces. Needs Python with VTK (Debian: python3-vtk9) and Xvfb.
#   volume_picture.sh LEVELSMITH HEAD.nii.gz
set -eu
[ $# -eq 2 ] || { sed -n '2,6s/^# *//p' "$0"; exit 2; }
python=${PYTHON:-/usr/bin/python3}
"$python" -c 'import vtk' 2>/dev/null || { echo "volume_picture.sh: VTK for Python is missing; install python3-vtk9"; exit 2; }
command -v xvfb-run >/dev/null || { echo "volume_picture.sh: xvfb-run is missing; install xvfb"; exit 2; }
LP_NUM_THREADS=1 LIBGL_ALWAYS_SOFTWARE=1 exec xvfb-run -a "$python" "$(dirname "$0")/volume_picture.py" "$1" "$2"
