#include "mapping/geometric_texture.h"
