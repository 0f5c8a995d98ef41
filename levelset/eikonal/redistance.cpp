#include "levelset/eikonal/redistance.h"
