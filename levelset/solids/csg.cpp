#include "levelset/solids/csg.h"
