#include "levelset/convert/band_to_mesh.h"
