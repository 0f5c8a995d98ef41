#include "levelset/solids/clip.h"
