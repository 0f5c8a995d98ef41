#include "render/embree/embree_renderer.h"
