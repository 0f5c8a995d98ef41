#include "levelset/convert/mesh_to_band.h"
