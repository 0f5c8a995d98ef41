#include "levelset/convert/mesh_file.h"
