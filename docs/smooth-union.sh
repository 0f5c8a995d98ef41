#!/bin/sh
# The lens of two balls under the three smooth operators: smooth-union.sh COMMAND FOLDER writes FOLDER/smooth-union.png
set -eu
command=$(realpath "$1")
mkdir -p "$2"
cd "$2"
for operator in union intersection difference; do
  "$command" --quiet sphere --radius 1 --voxel 0.02 ! sphere --radius 0.8 --center 0.95,0.2,0.1 --voxel 0.02 \
    ! smooth-$operator --radius 0.4 \
    ! render $operator.png --size 320x320 --from 1.5,-4.5,3 --to 0.35,0.1,0 --up 0,0,1 --fov 32
done
/usr/bin/python3 - <<'END'
import matplotlib.image, numpy
images = [matplotlib.image.imread(f"{name}.png") for name in ("union", "intersection", "difference")]
on_white = [image[:, :, :3] * image[:, :, 3:] + 1 - image[:, :, 3:] for image in images]
matplotlib.image.imsave("smooth-union.png", numpy.clip(numpy.hstack(on_white), 0, 1))
END
rm union.png intersection.png difference.png
