#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"
int main(void){
 static const char*ms[]={"adaptive&estimator=pcf","adaptive&estimator=pcf&mode=fixed2","adaptive&estimator=pcf&mode=average","adaptive&estimator=pcf&theta=0.2244","adaptive&estimator=csm","adaptive&estimator=csm&mode=fixed2","adaptive&estimator=csm&mode=average","adaptive&estimator=csm&terms=8&search_taps=1&taps=1","adaptive&estimator=csm&terms=8&theta=.2244&blend=0&colour=0","adaptive&estimator=csm&terms=8","adaptive&theta=0.25&blend=0","adaptive&theta=-1","multisample&samples=256"};
 struct planar_case t={.c=1.2,.h=3,.a=.5}; uint8_t id[32];
  harness_scene(&(struct pen_generated_options){.kind=PEN_GENERATED_HALF_PLANE,.caster_height=1.2f},id);
 for(unsigned i=0;i<sizeof ms/sizeof*ms;i++){ char s[1024]; double w; struct shot shot;
  snprintf(s,sizeof s,"technique=%s&" HARNESS_VIEW "%s&light.texture.pattern=two-colour",ms[i],textured_light(0,-1));
  harness_shot(id,s,&shot); double e=textured_t5(&shot,&t,true,&w);
  fprintf(stderr,"%-60s T5 rmse %.4f worst %.4f  split %u %u %u\n",ms[i],e,w,shot.result.subdivided_pixels[0],shot.result.subdivided_pixels[1],shot.result.subdivided_pixels[2]);
  harness_shot_finish(&shot);}
 return 0;}
