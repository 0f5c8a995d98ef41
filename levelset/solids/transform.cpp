#include "levelset/solids/transform.h"
