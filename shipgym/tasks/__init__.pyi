from shipgym.tasks.definition import TaskDefinition as TaskDefinition
from shipgym.tasks.definition import read_definition as read_definition
from shipgym.tasks.task import Task as Task
from shipgym.tasks.task import control_interval as control_interval
from shipgym.tasks.task import course_keeping_task as course_keeping_task
from shipgym.tasks.task import path_following_task as path_following_task
