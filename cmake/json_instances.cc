#define LUMI_JSON_INSTANCES
#include "json_instances.h"
