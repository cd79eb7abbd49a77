#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"
int main(int argc,char**argv){
 const char *m = argc>1?argv[1]:"cssm";
 float hs[]={2.1f,1.5f,1.2f,.6f,.3f};
 for(int i=0;i<5;i++){ double c=hs[i],h=3,a=.25; struct planar_case t={.c=c,.h=h,.a=a}; uint8_t id[32];
  harness_scene(&(struct pen_generated_options){.kind=PEN_GENERATED_HALF_PLANE,.caster_height=hs[i]},id);
  char s[1024]; snprintf(s,sizeof s,"technique=%s&" HARNESS_VIEW "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1&light.width=0.5&light.height=0.5",m);
  struct shot shot; harness_shot(id,s,&shot); double e=.8*2*a*c/(h-c);
  struct deviation d=harness_deviation(&shot,truth_half_plane,&t);
  fprintf(stderr,"T1 c %.1f rmse %.4f pen %.4f worst %.3f mean %+.4f width/expected %.3f\n",c,d.rmse,d.rmse_penumbra,d.worst,d.mean,harness_width_10_90(&shot)/e);
  if(argc>2) for(int x=0;x<256;x+=4) fprintf(stderr,"%.3f:%.3f/%.3f ",shot.position[4*(128*256+x)],shot.visibility[4*(128*256+x)+3],truth_half_plane(shot.position[4*(128*256+x)],0,&t));
  harness_shot_finish(&shot);}
 struct planar_case t={.c=1.2,.h=3,.a=.5,.s=.4}; uint8_t id[32]; struct shot shot; char s[1024]; struct deviation d;
 harness_scene(&(struct pen_generated_options){.kind=PEN_GENERATED_SQUARE},id);
 snprintf(s,sizeof s,"technique=%s&" HARNESS_VIEW HARNESS_RECT,m); harness_shot(id,s,&shot); d=harness_deviation(&shot,truth_square,&t);
 fprintf(stderr,"T2 rmse %.4f pen %.4f worst %.3f\n",d.rmse,d.rmse_penumbra,d.worst);
 harness_scene(&(struct pen_generated_options){.kind=PEN_GENERATED_HALF_PLANE,.caster_height=1.2f},id);
 snprintf(s,sizeof s,"technique=%s&" HARNESS_VIEW HARNESS_DISK,m); harness_shot(id,s,&shot); d=harness_deviation(&shot,truth_half_plane_disk,&t);
 fprintf(stderr,"T3 rmse %.4f pen %.4f worst %.3f\n",d.rmse,d.rmse_penumbra,d.worst);
 harness_scene(&(struct pen_generated_options){.kind=PEN_GENERATED_STACKED},id);
 snprintf(s,sizeof s,"technique=%s&" HARNESS_VIEW HARNESS_RECT,m); harness_shot(id,s,&shot); 
 double worst=0; int row=128; for(int x=0;x<256;x++) { float v=shot.visibility[4*(row*256+x)+3]; if (x%8==0) fprintf(stderr,"%.2f:%.3f ",shot.position[4*(row*256+x)],v); } fprintf(stderr,"\n");(void)worst;
 return 0;}
