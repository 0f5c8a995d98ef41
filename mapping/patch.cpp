#include "mapping/patch.h"
