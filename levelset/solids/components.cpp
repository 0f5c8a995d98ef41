#include "levelset/solids/components.h"
